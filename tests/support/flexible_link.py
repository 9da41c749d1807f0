"""Model file of one flexible link that a motor swings up and down, with a load at its end and a strain gauge."""


def one_flexible_link(
    level: str, *, young: str, section: tuple[float, float], damping: float, gains: tuple[float, float]
) -> str:
    """Model file with what differs filled in: ``section`` m, ``damping`` ms, ``gains`` in N m/rad and N m s/rad."""
    width, height = section
    return f"""
name = "one flexible link"
gravity = [0.0, 0.0, -9.81]
[bodies.hub]
mass = 0.5
inertia = [0.01, 0.01, 0.01, 0, 0, 0]
[bodies.load]
mass = 0.2
inertia = [1e-4, 1e-4, 1e-4, 0, 0, 0]
[joints.shoulder]
type = "revolute"
parent = "world"
child = "hub"
axis = [0.0, -1.0, 0.0]
[joints.grip]
type = "fixed"
parent = "link"
child = "load"
[beams.link]
parent = "hub"
rotation = [0.0, 1.5707963267948966, 0.0]
length = 0.5
level = "{level}"
deforms = ["bending_y"]
material = {{ young = {young}, density = 7850.0 }}
section = {{ shape = "rectangle", width = {width}, height = {height} }}
damping = {{ stiffness = {{ value = {damping}, unit = "ms" }} }}
[gauges.root]
beam = "link"
at = 0.05
x = -0.002
[actuators.motor]
joint = "shoulder"
command_unit = "N m"
gain = 1.0
[controllers.servo]
type = "pid"
actuator = "motor"
measures = "shoulder.position"
proportional = {gains[0]}
derivative = {gains[1]}
"""
