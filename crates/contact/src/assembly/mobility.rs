//! How easily single contacts move along their normals, without the rest of the matrix.

use super::delassus::{AssemblyError, InverseDynamics, touches};
use super::point::PosedContact;
use crate::block::dot;
use rayon::prelude::*;

/// Mobility of each contact along its normal \[1/kg\]: the first entry of its diagonal block of the Delassus matrix.
///
/// # Errors
/// If a contact lies outside its strand or a number is not finite.
pub fn normal_mobilities<D: InverseDynamics>(
    contacts: &[PosedContact],
    dynamics: &D,
    strands: usize,
) -> Result<Vec<f64>, AssemblyError> {
    let (touched, _) = touches(contacts, dynamics, strands)?;
    let shares: Vec<Vec<f64>> = touched
        .par_iter()
        .map_init(Vec::new, |columns: &mut Vec<f64>, (strand, touches)| {
            let mut shares = Vec::with_capacity(touches.len());
            // three contacts in one pass of the factors
            for three in touches.chunks(3) {
                columns.clear();
                columns.resize(3 * dynamics.dofs(*strand), 0.0);
                let places = |c: usize, dof: u32| (0..3).map(move |i| 3 * (dof as usize + i) + c);
                for (c, touch) in three.iter().enumerate() {
                    let normal = &contacts[touch.contact as usize].normal;
                    for (dof, weight) in touch.terms() {
                        places(c, *dof).zip(normal).for_each(|(place, n)| columns[place] += weight * n);
                    }
                }
                dynamics.apply_three(*strand, columns);
                shares.extend(three.iter().enumerate().map(|(c, touch)| {
                    let normal = &contacts[touch.contact as usize].normal;
                    let velocity = |dof: u32| [0, 1, 2].map(|i| columns[3 * (dof as usize + i) + c]);
                    touch.terms().iter().map(|(dof, weight)| weight * dot(normal, &velocity(*dof))).sum::<f64>()
                }));
            }
            shares
        })
        .collect();
    let mut mobilities = vec![0.0; contacts.len()];
    for ((strand, touches), shares) in touched.iter().zip(shares) {
        for (touch, share) in touches.iter().zip(shares) {
            if !share.is_finite() {
                return Err(AssemblyError::NotFinite { strand: *strand });
            }
            mobilities[touch.contact as usize] += share;
        }
    }
    Ok(mobilities)
}
