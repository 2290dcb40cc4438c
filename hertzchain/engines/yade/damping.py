"""Damping that Yade does not have."""

from __future__ import annotations

from hertzchain.errors import RunFailed
from hertzchain.scene.terms import Contact


def refuse_damping(contact: Contact | None) -> None:
    """Raise RunFailed for damping that Yade does not have."""
    if contact is None:
        return
    if contact.restitution is None:
        raise RunFailed(
            f"Yade has no {contact.damping} damping with Hertz's law: take damping ="
            ' "restitution", or another backend'
        )
    if contact.attraction:
        raise RunFailed(
            "contacts never pull in Yade: leave out attraction, or take another backend"
        )
