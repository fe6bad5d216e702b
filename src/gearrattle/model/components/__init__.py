"""The components that connect the bodies of a driveline, one file for every kind.

``COMPONENTS`` maps an array of tables of the model file to its class; elements are in the order of ``COMPONENTS``.
"""

from gearrattle.model.components.bearing import Bearing
from gearrattle.model.components.component import Component
from gearrattle.model.components.coupling import Coupling
from gearrattle.model.components.mesh import Mesh
from gearrattle.model.components.planetary import Planetary

COMPONENTS: dict[str, type[Component]] = {
    "coupling": Coupling,
    "mesh": Mesh,
    "planetary": Planetary,
    "bearing": Bearing,
}

__all__ = ["COMPONENTS", "Bearing", "Component", "Coupling", "Mesh", "Planetary"]
