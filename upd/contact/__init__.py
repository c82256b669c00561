"""Contact and friction between condensed bodies."""

from typing import TYPE_CHECKING

from upd.lazy_names import load_on_use

if TYPE_CHECKING:
    from upd.contact.coupled import CoupledContact as CoupledContact
    from upd.contact.coupled import coupled_contact as coupled_contact
    from upd.contact.law import ContactLaw as ContactLaw
    from upd.contact.law import contact_points as contact_points
    from upd.contact.load_steps import CoupledHistory as CoupledHistory
    from upd.contact.normal import NormalContact as NormalContact
    from upd.contact.normal import normal_contact as normal_contact
    from upd.contact.normal import normal_curve as normal_curve
    from upd.contact.tangential import TangentialContact as TangentialContact
    from upd.contact.tangential import TangentialHistory as TangentialHistory
    from upd.contact.tangential import TangentialPath as TangentialPath
    from upd.contact.tangential import tangential_contact as tangential_contact
    from upd.contact.tangential import tangential_path as tangential_path
    from upd.contact.tilt import TiltedContact as TiltedContact
    from upd.contact.tilt import tilted_contact as tilted_contact
else:
    __getattr__, __dir__, __all__ = load_on_use(
        __name__,
        {
            "coupled": "CoupledContact coupled_contact",
            "law": "ContactLaw contact_points",
            "load_steps": "CoupledHistory",
            "normal": "NormalContact normal_contact normal_curve",
            "tangential": (
                "TangentialContact TangentialHistory TangentialPath tangential_contact "
                "tangential_path"
            ),
            "tilt": "TiltedContact tilted_contact",
        },
    )
