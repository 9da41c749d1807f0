"""A second suite of blind cases for the diagnosis: other machines, other habits, other laws than in `blind`.

Nine machines, written from the laws of mechanics in NumPy alone: a belt axis, a rotary arm on a gear, a cart with a
pendulum, a SCARA, a hoist with a load on a springy rope, a six-axis arm, a boom on a hydraulic cylinder, and two
slewing arms with a blade that bends, one of them with a strain gauge. Joints truly stick (`plant.py`), hysteresis is of
Maxwell slip, friction sits behind soft gears on some machines, only two model files know the controller, there are
joints without a drive or an encoder, and each case has four records of unequal lengths.

    python -m tests.second_suite.run --solver diagnose --seeds 0 --machine belt

Cases are frozen: a generator is changed for an error of its physics, never to suit a solver.

``machine.py``   what a machine says of itself; ``belt.py`` to ``boom.py``, ``slewer.py`` and ``sweeper.py`` are some
``pid.py``       the controller that two model files know
``laws.py``      forces; ``plant.py`` the machine in time; ``loop.py`` sensors, controllers, drives
``oil.py``       a cylinder with its valve and pump
``blade.py``     a blade that bends, on a hub; ``entries.py`` what a file says of what is hidden
``motions.py``   references
``cases.py``     cases, which of them are frozen, and the rule that says which can be solved; ``logs.py`` their records
``solvers.py``   what can be asked; ``score.py`` what counts as right; ``run.py`` the runner
"""
