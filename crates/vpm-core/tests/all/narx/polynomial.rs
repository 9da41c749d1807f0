//! Polynomial NARX models: structure, one-step prediction and free run, divergence, selection of terms, what records cannot tell.

use allocation_counter::measure;
use vpm_core::error::NarxError;
use vpm_core::narx::{Factor, Lags, Narx, Record, Stop, Structure, Term, candidates, fit, select};
use vpm_core::samples::Random;
use vpm_core::{Error, Result};

fn signals(inputs: usize) -> Vec<String> {
    let inputs = (1..=inputs).map(|at| format!("u{at}"));
    std::iter::once("y".to_owned()).chain(inputs).collect()
}

fn y(delay: usize) -> Factor {
    Factor { signal: 0, delay }
}

fn u(delay: usize) -> Factor {
    Factor { signal: 1, delay }
}

fn model(terms: &[(&[Factor], f64)]) -> Result<Narx> {
    let (terms, theta): (Vec<_>, Vec<_>) =
        terms.iter().map(|(factors, value)| (Term::new(factors.to_vec()), *value)).unzip();
    Narx::new(Structure::new(&signals(1), terms)?, &theta)
}

/// `y[k] = 0.5 y[k-1] + u[k-2] + 0.1 u[k-2]^2 + 0.05 y[k-1] u[k-2]`.
fn quadratic() -> Result<Narx> {
    model(&[(&[y(1)], 0.5), (&[u(2)], 1.0), (&[u(2), u(2)], 0.1), (&[u(2), y(1)], 0.05)])
}

fn simulated(model: &Narx, inputs: &[f64], noise: f64) -> Result<Vec<f64>> {
    let start = vec![0.0; inputs.len()];
    let mut output = model.simulate_free_run(&Record { name: "truth", output: &start, inputs }, f64::INFINITY)?;
    let disturb = Random::new(99).numbers(inputs.len(), noise);
    output.iter_mut().zip(disturb).for_each(|(y, e)| *y += e);
    Ok(output)
}

fn pool() -> Result<Structure> {
    let lags = [Lags { signal: 0, delays: vec![1, 2] }, Lags { signal: 1, delays: vec![1, 2] }];
    Structure::new(&signals(1), candidates(&lags, 3, true))
}

fn message<T>(result: Result<T>) -> String {
    result.err().map(|error| error.to_string()).unwrap_or_default()
}

#[test]
fn candidates_are_all_monomials_once() -> Result<()> {
    let pool = pool()?;
    assert_eq!(pool.terms().len(), 35, "binomial(4 + 3, 3)");
    assert_eq!(pool.terms()[0].text(pool.signals()), "1");
    assert_eq!(pool.longest_lag(), 2);
    let mixed = Term::new(vec![u(0), y(1), y(1)]);
    assert_eq!(mixed.text(pool.signals()), "y[k-1]^2*u1[k]");
    Ok(())
}

#[test]
fn prediction_looks_at_measured_and_free_run_at_simulated_past() -> Result<()> {
    let model = quadratic()?;
    let (output, inputs) = ([1.0, 2.0, 3.0, 4.0], [0.5, -1.0, 2.0, 0.0]);
    let record = Record { name: "r", output: &output, inputs: &inputs };
    let next = |y: f64, u: f64| 0.5 * y + u + 0.1 * u * u + 0.05 * y * u;
    let predicted = model.predict_one_step(&record)?;
    assert_eq!(predicted, [1.0, 2.0, next(2.0, 0.5), next(3.0, -1.0)]);
    let third = next(2.0, 0.5);
    assert_eq!(model.simulate_free_run(&record, 1e3)?, [1.0, 2.0, third, next(third, -1.0)]);
    Ok(())
}

#[test]
fn steps_are_the_free_run_and_allocate_nothing() -> Result<()> {
    // The second has too wide a window for the narrow program, and a power beyond the third.
    let wide = [Factor { signal: 1, delay: 200 }];
    for model in [quadratic()?, model(&[(&[y(1)], 0.3), (&wide, 1.0), (&[u(0); 5], 0.2)])?] {
        let inputs = Random::new(4).numbers(1500, 1.0);
        let run = simulated(&model, &inputs, 0.0)?;
        let lag = model.structure().longest_lag();
        let mut stepper = model.stepper();
        stepper.start(&vec![0.0; lag], &inputs[..lag])?;
        let mut same = true;
        let counted = measure(|| {
            for (u, y) in inputs.iter().zip(&run).skip(lag) {
                same &= stepper.step(std::slice::from_ref(u)) == *y;
            }
        });
        assert!(same);
        assert_eq!(counted.count_total, 0);
        // Beyond one lap of the buffer, a missing input is zero and not what stood there before.
        assert_eq!(stepper.clone().step(&[]), stepper.clone().step(&[0.0]));
        stepper.start(&vec![0.0; lag], &inputs[..lag])?;
        let record = Record { name: "r", output: &run, inputs: &inputs };
        let predicted = model.predict_one_step(&record)?;
        for k in lag..inputs.len() {
            assert_eq!(stepper.step_measured(&inputs[k..=k], run[k]), predicted[k]);
        }
    }
    Ok(())
}

#[test]
fn divergence_says_where_and_keeps_what_came_before() -> Result<()> {
    let model = model(&[(&[y(1), y(1)], 1.0), (&[u(1)], 0.0)])?;
    let record = Record { name: "blow-up", output: &[10.0; 20], inputs: &[0.0; 20] };
    let Err(Error::Narx(error)) = model.simulate_free_run(&record, 1e6) else {
        return Err(Error::OpenLoop);
    };
    let NarxError::Diverged { sample, value, samples, .. } = *error else { return Err(Error::OpenLoop) };
    assert_eq!((sample, value), (3, 1e8), "10, 100, 1e4, 1e8");
    assert_eq!(samples, [10.0, 100.0, 1e4]);
    let text = message(model.simulate_free_run(&record, 1e6));
    assert!(text.contains("`blow-up`") && text.contains("sample 3") && text.contains("1e8"), "{text}");
    assert!(message(model.simulate_free_run(&record, f64::INFINITY)).contains("inf"));
    Ok(())
}

#[test]
fn selection_recovers_terms_and_coefficients_from_noise() -> Result<()> {
    let truth = quadratic()?;
    let inputs = [Random::new(1).numbers(600, 1.0), Random::new(2).numbers(400, 1.0)];
    let outputs = [simulated(&truth, &inputs[0], 1e-3)?, simulated(&truth, &inputs[1], 1e-3)?];
    let record = |at: usize| Record { name: "r", output: &outputs[at], inputs: &inputs[at] };
    let records = [record(0), record(1)];
    for stop in [Stop::Terms, Stop::Unexplained(1e-5), Stop::Bic, Stop::FreeRunTail(0.3)] {
        let most = if stop == Stop::Terms { 4 } else { 10 };
        let found = select(&pool()?, &records, most, stop)?;
        let terms = found.model.structure().terms();
        for (term, value) in truth.structure().terms().iter().zip(truth.coefficients()) {
            let at = terms.iter().position(|found| found == term);
            let close = at.is_some_and(|at| (found.model.coefficients()[at] - value).abs() < 2e-3);
            assert!(close, "{stop:?}: {:?} misses {}", found.model, term.text(truth.structure().signals()));
        }
        // The tail may keep a term of no weight; the other criteria find exactly the four.
        assert!(terms.len() == 4 || matches!(stop, Stop::FreeRunTail(_) | Stop::Bic), "{stop:?}: {}", terms.len());
        assert!(found.error_reduction.is_sorted_by(|a, b| a > b) || terms.len() > 4);
    }
    Ok(())
}

#[test]
fn error_reduction_sums_to_what_least_squares_explains() -> Result<()> {
    let truth = quadratic()?;
    let inputs = Random::new(6).numbers(300, 1.0);
    let output = simulated(&truth, &inputs, 0.1)?;
    let record = Record { name: "r", output: &output, inputs: &inputs };
    let found = select(&pool()?, &[record], 7, Stop::Terms)?;
    let predicted = found.model.predict_one_step(&record)?;
    let squares = |values: &mut dyn Iterator<Item = f64>| values.map(|value| value * value).sum::<f64>();
    let rest = squares(&mut (2..300).map(|k| output[k] - predicted[k]));
    let whole = squares(&mut (2..300).map(|k| output[k]));
    let explained: f64 = found.error_reduction.iter().sum();
    assert!((1.0 - explained - rest / whole).abs() < 1e-12);
    Ok(())
}

#[test]
fn what_records_cannot_tell_is_named() -> Result<()> {
    let inputs = Random::new(8).numbers(50, 1.0);
    let output = simulated(&quadratic()?, &inputs, 0.01)?;
    let record = Record { name: "r", output: &output, inputs: &inputs };
    let few = Record { name: "r", output: &output[..20], inputs: &inputs[..20] };
    assert!(message(fit(&pool()?, &[few])).contains("18 equations for 35 parameters"));
    let short = Record { name: "tiny", output: &output[..2], inputs: &inputs[..2] };
    assert!(message(fit(&pool()?, &[short])).contains("`tiny` has 2 samples"));
    let still = Record { name: "r", output: &output, inputs: &[3.0; 50] };
    assert!(message(select(&pool()?, &[still], 3, Stop::Terms)).contains("`u1` has the value 3"));
    let mut broken = output.clone();
    broken[7] = f64::NAN;
    let broken = Record { name: "r", output: &broken, inputs: &inputs };
    assert!(message(fit(&pool()?, &[broken])).contains("`y` of record `r` is NaN at sample 7"));
    assert!(message(quadratic()?.predict_one_step(&Record { inputs: &inputs[..49], ..record })).contains("49 numbers"));
    // Two inputs that are one and the same.
    let twice: Vec<f64> = inputs.iter().flat_map(|&u| [u, 2.0 * u]).collect();
    let twice = Record { name: "r", output: &output, inputs: &twice };
    let terms = [vec![y(1)], vec![u(1)], vec![Factor { signal: 2, delay: 1 }]].map(Term::new).to_vec();
    let both = Structure::new(&signals(2), terms)?;
    let text = message(fit(&both, &[twice]));
    assert!(text.contains("`u2[k-1]` is a linear combination of `u1[k-1]` "), "{text}");
    let found = select(&both, &[twice], 3, Stop::Terms)?;
    assert_eq!(found.model.structure().terms().len(), 2);
    assert_eq!(found.dependent.len(), 1);
    Ok(())
}

#[test]
fn impossible_structures_are_refused() -> Result<()> {
    let of = |terms: &[&[Factor]]| Structure::new(&signals(1), terms.iter().map(|f| Term::new(f.to_vec())).collect());
    assert!(message(of(&[&[y(0)]])).contains("contains the output"));
    assert!(message(of(&[&[u(1)], &[u(1)]])).contains("`u1[k-1]` is there twice"));
    assert!(message(of(&[&[Factor { signal: 2, delay: 0 }]])).contains("signal 2"));
    assert!(message(Narx::new(of(&[&[u(1)]])?, &[])).contains("are 0"));
    assert!(message(Narx::new(of(&[&[u(1)]])?, &[f64::NAN])).contains("NaN"));
    Ok(())
}
