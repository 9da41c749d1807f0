//! The equations of a machine as one graph: rates and outputs over states, inputs and some of the parameters.

use crate::description::Description;
use crate::error::{Error, Result};
use crate::graph::{Graph, Node, Recorded, input, record};
use crate::system::Build;

/// Rates and outputs as numbers of a graph, whose inputs are the states, then the inputs, then the free parameters.
pub(super) struct Recording {
    pub(super) graph: Graph,
    pub(super) rates: Vec<Node>,
    pub(super) outputs: Vec<Node>,
}

impl Recording {
    /// Records `description` at the parameters `theta`, of which those at the places `free` stay numbers that may change.
    ///
    /// As in [`crate::linearize::linearize`], delays pass commands and readings unchanged, and outputs are what sensors show.
    pub(super) fn new(description: &Description, theta: &[f64], free: &[usize]) -> Result<Self> {
        let first = description.n_states() + description.n_inputs();
        let (nodes, graph) = record(first as u32, || machine(description, theta, free));
        let (rates, outputs) = nodes?;
        match graph.decisions().first() {
            None => Ok(Self { graph, rates, outputs }),
            Some(decision) => {
                let place = decision.place();
                let what = if !decision.of_parameters {
                    "a state or an input, so that no formula holds everywhere; leave out the effect or the drive that it belongs to".to_owned()
                } else {
                    let names: Vec<_> = free.iter().filter(|&&one| decides(description, theta, one)).collect();
                    let names: Vec<_> =
                        names.iter().map(|&&one| format!("`{}`", description.parameter_names[one])).collect();
                    format!("a parameter; take {} out of the parameters that stay free", names.join(", "))
                };
                Err(Error::Unrecorded { place, what })
            }
        }
    }
}

/// Whether a law decides by the value of parameter `one`.
fn decides(description: &Description, theta: &[f64], one: usize) -> bool {
    let first = description.n_states() + description.n_inputs();
    let (nodes, graph) = record(first as u32, || machine(description, theta, &[one]));
    nodes.is_ok() && graph.decisions().iter().any(|decision| decision.of_parameters)
}

type Nodes = (Vec<Node>, Vec<Node>);

fn machine(description: &Description, theta: &[f64], free: &[usize]) -> Result<Nodes> {
    let (nx, nu) = (description.n_states(), description.n_inputs());
    // No formula depends on these values; nothing is at rest or in a symmetric place.
    let state: Vec<_> = (0..nx).map(|place| input(place, 0.1 * (1.0 + place as f64).sin())).collect();
    let commands: Vec<_> = (0..nu).map(|place| input(nx + place, 0.1)).collect();
    let mut numbers: Vec<_> = theta.iter().map(|&value| Recorded::from(value)).collect();
    for (place, &parameter) in free.iter().enumerate() {
        numbers[parameter] = input(nx + nu + place, theta[parameter]);
    }
    let mut dynamics = description.dynamics(&numbers)?;
    for (number, &command) in commands.iter().enumerate() {
        let held = dynamics.input(number, 0, 1.0, |_| command);
        dynamics.hold(number, held);
    }
    let mut rates = vec![Recorded::default(); nx];
    dynamics.rhs(&state, &mut rates);
    let mut outputs = vec![Recorded::default(); description.n_outputs()];
    let layout = dynamics.layout();
    dynamics.observe(&state, &rates, &mut outputs);
    for (channels, &command) in outputs[layout.actuators()..layout.lines()].chunks_exact_mut(2).zip(&commands) {
        channels[0] = command;
    }
    for sensor in &description.sensors(&numbers) {
        let reading = &mut outputs[sensor.channel.column(layout)];
        let truth = *reading;
        *reading = sensor.read(0, 1.0, |_| truth);
    }
    let nodes = |numbers: &[Recorded]| numbers.iter().map(|number| number.node()).collect();
    Ok((nodes(&rates), nodes(&outputs)))
}
