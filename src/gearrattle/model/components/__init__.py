"""The components: what connects the bodies of a driveline, one file each.

``COMPONENTS`` says which array of tables of the model file holds which; elements come in its order.
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
