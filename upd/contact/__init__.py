"""Contact and friction between condensed bodies."""

from upd.contact.coupled import CoupledContact, CoupledHistory, coupled_contact
from upd.contact.law import ContactLaw, contact_points
from upd.contact.normal import NormalContact, normal_contact, normal_curve
from upd.contact.tangential import (
    TangentialContact,
    TangentialHistory,
    TangentialPath,
    tangential_contact,
    tangential_path,
)
from upd.contact.tilt import TiltedContact, tilted_contact

__all__ = [
    "ContactLaw",
    "CoupledContact",
    "CoupledHistory",
    "NormalContact",
    "TangentialContact",
    "TangentialHistory",
    "TangentialPath",
    "TiltedContact",
    "contact_points",
    "coupled_contact",
    "normal_contact",
    "normal_curve",
    "tangential_contact",
    "tangential_path",
    "tilted_contact",
]
