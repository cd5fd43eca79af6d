//! The cross-linked assembly of 45 grains, step by step.

use super::reference::{assembly, larger, list, number, sample, state_error, tensor_error};
use crate::case::{Case, CaseError, Outcome, Param, Params};

/// Case.
pub const CASE: Case = Case {
    id: "granular/assembly-n45",
    about: "The compat mode follows 45 cross-linked grains under oscillation (μ 0.1, amplitude 0.2) through the \
            original program's snapshots of state and stress.",
    params: &[Param::count("steps", 1000, "steps to follow, at most 1000")],
    run,
};

fn run(p: &Params) -> Result<Outcome, CaseError> {
    let steps = p.count_in("steps", 1, 1000)? as u64;
    let data = assembly()?;
    let mut s = sample(&data["params"], &data["initial"], true);
    let (dt, damping) = (number(&data["dt"]), number(&data["cool"]));
    let (amplitude, frequency) = (number(&data["amplitude"]), number(&data["f"]));
    let (mut done, mut tensors, mut state, mut identities) = (0, 0.0, 0.0, 0.0);
    for snapshot in list(&data["snapshots"]) {
        let step = snapshot["step"].as_u64().unwrap_or(0);
        if step > steps {
            break;
        }
        while done < step {
            let turn = std::f64::consts::TAU * frequency;
            s.set_rate(amplitude * turn * (turn * s.time).cos());
            s.evaluate();
            done += 1;
            if done == step {
                tensors = larger(tensors, tensor_error(&s, &snapshot["tensors_before_move"]));
                identities = larger(identities, s.stresses().identity_defect());
            }
            s.integrate(dt, damping, true).map_err(CaseError::failed)?;
        }
        state = larger(state, state_error(&s, &snapshot["state_after"]));
    }
    let mut out = Outcome::new();
    out.compare("state_difference", state, 0.0, 1e-10);
    out.compare("stress_difference", tensors, 0.0, 1e-10);
    out.compare("identity_defect", identities, 0.0, 1e-12);
    out.info("steps", done as f64);
    Ok(out)
}
