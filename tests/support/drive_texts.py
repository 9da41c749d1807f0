"""Model files with drives: a servo-cylinder on a bench, a motor with a gear, a leg with springs along a line."""

from model_texts import TWO_LINKS
from places import EXAMPLES

RIG = (EXAMPLES / "servo_cylinder" / "rig.toml").read_text(encoding="utf-8")

MOTOR = """
name = "motor bench"
gravity = [0.0, 0.0, 0.0]

[bodies.drum]
mass = 1.0
inertia = [0.02, 0.02, 0.02, 0.0, 0.0, 0.0]

[joints.axis]
type = "revolute"
parent = "world"
child = "drum"
axis = [0.0, 0.0, 1.0]

[actuators.motor]
type = "dc_motor"
joint = "axis"
resistance = { value = 2.0, unit = "Ohm" }
time_constant = { value = 1.0, unit = "ms" }
torque_constant = { value = 50.0, unit = "N mm/A", uncertainty = 5.0 }
gear_ratio = 20.0
"""

SPRUNG = f"""
name = "sprung leg"
gravity = [0.0, 0.0, -9.81]

{TWO_LINKS}
[lines.hip_strut]
from = {{ parent = "world", point = [0.1, 0.0, 0.0] }}
to = {{ parent = "thigh", point = [0.05, 0.0, -0.3] }}

[lines.knee_strut]
from = {{ parent = "thigh", point = [0.05, 0.0, -0.1] }}
to = {{ parent = "shank", point = [0.05, 0.0, -0.1] }}

[actuators.hip_drive]
type = "spring_damper"
line = "hip_strut"
stiffness = {{ value = 83.0, unit = "kN/m" }}
free_length = {{ value = 300.0, unit = "mm" }}
damping = {{ value = 3.3, unit = "kN s/m" }}

[actuators.knee_drive]
type = "maxwell"
line = "knee_strut"
stiffness = {{ value = 44.0, unit = "kN/m" }}
free_length = {{ value = 420.0, unit = "mm" }}
fast_stiffness = {{ value = 20.0, unit = "kN/m" }}
relaxation_time = {{ value = 4.0, unit = "ms" }}
"""
