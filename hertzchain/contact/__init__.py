"""The contact of two granules."""
