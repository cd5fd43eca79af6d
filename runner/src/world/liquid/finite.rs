//! No number that is not finite leaves a stage: each looks at what it wrote and names the first particle or face.

use mpm::{LiquidGrid, Particles};

use crate::system::{Element, Rejection, RejectionReason};

fn refuse(stage: &'static str, element: Option<Element>, detail: String) -> Rejection {
    Rejection { stage, reason: RejectionReason::NonFinite, element, detail }
}

/// Whether all numbers are finite: the sum of zero times each is zero, and only then.
fn all_finite(numbers: &[f64]) -> bool {
    // eight sums side by side, so that the look costs no more than the reading
    let mut sums = [0.0; 8];
    let chunks = numbers.chunks_exact(8);
    let rest: f64 = chunks.remainder().iter().map(|x| x * 0.0).sum();
    for chunk in chunks {
        for (sum, x) in sums.iter_mut().zip(chunk) {
            *sum += x * 0.0;
        }
    }
    sums.iter().sum::<f64>() + rest == 0.0
}

fn first_bad(numbers: &[f64]) -> Option<usize> {
    if all_finite(numbers) { None } else { numbers.iter().position(|x| !x.is_finite()) }
}

/// Numbers of vectors or tensors in a row.
fn flat<const R: usize, const C: usize>(list: &[nalgebra::SMatrix<f64, R, C>]) -> impl Iterator<Item = &[f64]> {
    list.iter().map(nalgebra::SMatrix::as_slice)
}

fn find<const R: usize, const C: usize>(list: &[nalgebra::SMatrix<f64, R, C>]) -> Option<usize> {
    // matrices of numbers lie one after the other
    let sound = flat(list).map(|x| x.iter().map(|x| x * 0.0).sum::<f64>()).sum::<f64>() == 0.0;
    if sound { None } else { flat(list).position(|x| x.iter().any(|x| !x.is_finite())) }
}

/// Looks at positions.
///
/// # Errors
/// Names the first particle whose position is not finite.
pub fn positions<const D: usize>(stage: &'static str, particles: &Particles<D>) -> Result<(), Rejection> {
    named(stage, particles, find(&particles.position), "position")
}

/// Looks at velocities and affine matrices.
///
/// # Errors
/// Names the first particle whose velocity or affine matrix is not finite.
pub fn velocities<const D: usize>(stage: &'static str, particles: &Particles<D>) -> Result<(), Rejection> {
    named(stage, particles, find(&particles.velocity), "velocity")?;
    named(stage, particles, find(&particles.affine), "affine matrix")
}

/// Looks at elastic strains, plastic histories and volume ratios.
///
/// # Errors
/// Names the first particle whose strain or volume ratio is not finite.
pub fn strains<const D: usize>(stage: &'static str, particles: &Particles<D>) -> Result<(), Rejection> {
    named(stage, particles, find(&particles.elastic_strain), "elastic strain")?;
    named(stage, particles, find(&particles.deformation_gradient), "plastic history")?;
    named(stage, particles, first_bad(&particles.volume_ratio), "volume ratio")
}

fn named<const D: usize>(
    stage: &'static str,
    particles: &Particles<D>,
    bad: Option<usize>,
    what: &str,
) -> Result<(), Rejection> {
    match bad {
        None => Ok(()),
        Some(place) => Err(refuse(stage, Some(Element::Particle(particles.id[place])), format!("its {what}"))),
    }
}

/// Looks at velocities and masses of faces and pressures of cells.
///
/// # Errors
/// Names the place of the first number that is not finite.
pub fn grid<const D: usize>(stage: &'static str, grid: &LiquidGrid<D>) -> Result<(), Rejection> {
    for (axis, face) in grid.face.iter().enumerate() {
        for (what, numbers) in [("velocity", &face.velocity), ("mass", &face.mass), ("shear force", &face.shear_force)]
        {
            if let Some(node) = first_bad(numbers) {
                let place: Vec<f64> = grid.face_position(axis, node).iter().copied().collect();
                return Err(refuse(stage, None, format!("{what} of the face at {place:?} m")));
            }
        }
    }
    if let Some(node) = first_bad(&grid.cell.pressure) {
        let place: Vec<f64> = grid.cell_position(node).iter().copied().collect();
        return Err(refuse(stage, None, format!("pressure of the cell at {place:?} m")));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_place_is_looked_at() {
        for n in [0, 1, 7, 8, 9, 64, 65] {
            for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
                let mut numbers = vec![1e300; n];
                assert_eq!(first_bad(&numbers), None);
                for k in 0..n {
                    numbers[k] = bad;
                    assert_eq!(first_bad(&numbers), Some(k));
                    numbers[k] = -2.0;
                }
            }
        }
        let mut vectors = vec![nalgebra::Vector3::new(1.0, 2.0, 3.0); 10];
        assert_eq!(find(&vectors), None);
        vectors[6].z = f64::NAN;
        assert_eq!(find(&vectors), Some(6));
    }
}
