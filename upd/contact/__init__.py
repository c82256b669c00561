"""Contact and friction between condensed bodies."""

from upd.contact.normal import NormalContact, normal_contact, normal_curve
from upd.contact.tangential import TangentialContact, TangentialHistory, TangentialPath, tangential_contact, tangential_path

__all__ = [
    "NormalContact",
    "TangentialContact",
    "TangentialHistory",
    "TangentialPath",
    "normal_contact",
    "normal_curve",
    "tangential_contact",
    "tangential_path",
]
