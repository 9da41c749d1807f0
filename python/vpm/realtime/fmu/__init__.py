"""Models as FMUs of FMI 3.0, for model exchange and co-simulation in other programs."""

from vpm.realtime.fmu.write import Fmu, write_fmu

__all__ = ["Fmu", "write_fmu"]
