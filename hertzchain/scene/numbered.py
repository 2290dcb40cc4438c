"""Places and numbers of the granules and contacts of a scene, which a near wall shifts by one."""

from __future__ import annotations

from hertzchain.scene.chain import Chain
from hertzchain.scene.shock import Shock
from hertzchain.scene.terms import Wall


class Numbered:
    """What numbers follow from chain, shock and walls."""

    chain: Chain
    shock: Shock
    wall: Wall | None
    near_wall: Wall | None

    @property
    def first_granule(self) -> int:
        """Place of granule 1 in ``granules``: 0, or 1 behind a near wall."""
        return 0 if self.near_wall is None else 1

    @property
    def bodies(self) -> int:
        """Number of entries of ``granules``: N, or N + 1 with a near wall."""
        return self.chain.granules + (self.near_wall is not None)

    @property
    def pushed(self) -> int:
        """Place in ``granules`` of the granule on which the force acts."""
        return self.shock.granule - 1 + self.first_granule

    @property
    def contacts(self) -> range:
        """Numbers of the contacts: from 2, or 1 with a near wall, to N, or N + 1 with a wall."""
        return range(2 - self.first_granule, self.chain.granules + 1 + (self.wall is not None))

    @property
    def last_contact(self) -> int:
        """Number of the last contact, N, or N + 1 with a wall."""
        return self.contacts[-1]

    def contact_label(self, contact: int) -> str:
        """Return what a table calls a contact: its number, or the wall."""
        name = self.contact_name(contact)
        return str(contact) if name.startswith("contact") else name.removeprefix("the ")

    def contact_name(self, contact: int) -> str:
        """Return what a sentence calls a contact."""
        if contact < 2:
            return "the near wall"
        return "the wall" if contact > self.chain.granules else f"contact {contact}"
