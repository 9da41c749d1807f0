"""A second suite of blind cases for the diagnosis: other machines, other habits, other laws than in `blind`.

Six machines, written from the laws of mechanics in NumPy alone: a belt axis, a rotary arm on a gear, a cart with a
pendulum, a SCARA, a hoist with a load on a springy rope, and a six-axis arm. Joints truly stick (`plant.py`),
hysteresis is of Maxwell slip, friction sits behind soft gears on some machines, four of six model files do not know the
controller, there are joints without a drive or an encoder, and each case has four records of unequal lengths.

    python -m tests.second_suite.run --solver diagnose --seeds 0 --machine belt

Cases are frozen: a generator is changed for an error of its physics, never to suit a solver.

``machine.py``   what a machine says of itself; ``belt.py`` to ``arm.py`` are the machines
``pid.py``       the controller that two model files know
``laws.py``      forces; ``plant.py`` the machine in time; ``loop.py`` encoders, controllers, drives
``motions.py``   references
``cases.py``     cases, which of them are frozen, and the rule that says which can be solved
``solvers.py``   what can be asked; ``score.py`` what counts as right; ``run.py`` the runner
"""
