//! The machine as it is stepped in time: that of the description, in which ball joints turn freely where they can.

use super::Description;
use crate::error::Result;
use crate::scalar::Scalar;
use crate::system::{Machine, System};

impl Description {
    /// System for stepping in time, with the parameters `theta`: ball joints turn freely where they can.
    pub(crate) fn system_to_step<S: Scalar>(&self, theta: &[S]) -> Result<System<S>> {
        let free: Vec<bool> = self.balls.iter().map(|ball| self.hindrance(ball).is_none()).collect();
        if !free.contains(&true) {
            return self.system(theta);
        }
        let values: Vec<f64> = theta.iter().map(Scalar::inspect).collect();
        self.check_values(&values)?;
        let mut machine = Machine { functions: self.functions_of_turned(), ..self.machine(theta, &values)? };
        self.turn_freely(&mut machine.dynamics);
        for _ in self.free_balls() {
            machine.inputs.extend([1.0, 0.0, 0.0, 0.0].map(S::from_f64));
        }
        Ok(System::new(machine)?.with_balls(self.balls.iter().zip(free)))
    }

    /// System for stepping once or less from `state`, which is brought into the coordinates of the step.
    pub(crate) fn system_to_step_from<S: Scalar>(&self, theta: &[S], state: &mut [S]) -> Result<System<S>> {
        let mut system = self.system_to_step(theta)?;
        system.enter(state);
        system.rest();
        Ok(system)
    }
}
