//! The text format of the public problem collections (white-space separated numbers).
//!
//! Dimension, number of contacts, storage of `M` (0 dense, 1 sparse block), rows and columns; then the matrix (dense:
//! rows, columns, entries column by column; sparse block: number of blocks, block rows, block columns, cumulative row
//! ends, cumulative column ends, lengths of the two index arrays, block-row starts, block columns, and for each block
//! its number and its entries column by column); then `q` and the friction coefficients.

use super::{BlockMatrix, ContactProblem, ProblemError};
use crate::block::{Block, Vec3, ZERO, max_abs};
use std::fmt::Write;

/// Reads a problem from text.
///
/// # Errors
/// [`ProblemError::Format`] with the place where the text departs from the format; never a panic.
pub fn read(text: &str) -> Result<ContactProblem, ProblemError> {
    let mut numbers = Numbers { rest: text.split_ascii_whitespace(), read: 0 };
    let dimension = numbers.count("dimension")?;
    if dimension != 2 && dimension != 3 {
        return Err(ProblemError::Format(format!("dimension {dimension} is neither 2 nor 3")));
    }
    let contacts = numbers.count("number of contacts")?;
    let storage = numbers.count("storage")?;
    let rows = numbers.count("rows")?;
    let columns = numbers.count("columns")?;
    if contacts.checked_mul(dimension) != Some(rows) || rows != columns {
        return Err(ProblemError::Format(format!("{rows}×{columns} matrix for {contacts} contacts")));
    }
    let mut triplets = match storage {
        0 => dense(&mut numbers, dimension, contacts)?,
        1 => sparse(&mut numbers, dimension, contacts)?,
        other => {
            return Err(ProblemError::Format(format!("storage {other} is not supported (0 dense, 1 sparse block)")));
        }
    };
    if dimension == 2 {
        // a second tangent that nothing moves: the mean of the block's own diagonal keeps its scale
        for (i, j, b) in &mut triplets {
            if i == j {
                b[8] = 0.5 * (b[0] + b[4]);
            }
        }
    }
    let mut free_velocity: Vec<Vec3> = vec![[0.0; 3]; contacts];
    for q in &mut free_velocity {
        for c in q.iter_mut().take(dimension) {
            *c = numbers.number("free velocity")?;
        }
    }
    let mut friction = Vec::with_capacity(contacts);
    for _ in 0..contacts {
        friction.push(numbers.number("friction")?);
    }
    let delassus = BlockMatrix::from_triplets(contacts, &triplets);
    let problem = ContactProblem { dimension, delassus, free_velocity, friction, cohesion: Vec::new() };
    problem.check()?;
    Ok(problem)
}

struct Numbers<'a> {
    rest: std::str::SplitAsciiWhitespace<'a>,
    read: usize,
}

impl Numbers<'_> {
    fn number(&mut self, what: &str) -> Result<f64, ProblemError> {
        self.read += 1;
        let word = self
            .rest
            .next()
            .ok_or_else(|| ProblemError::Format(format!("the text ends at number {} ({what})", self.read)))?;
        word.parse().map_err(|_| {
            ProblemError::Format(format!("number {} ({what}) is `{}`", self.read, &word[..word.len().min(30)]))
        })
    }

    fn count(&mut self, what: &str) -> Result<usize, ProblemError> {
        let v = self.number(what)?;
        if v >= 0.0 && v.fract() == 0.0 && v <= 1e9 {
            Ok(v as usize)
        } else {
            Err(ProblemError::Format(format!("number {} ({what}) is {v}, not a count", self.read)))
        }
    }
}

fn dense(numbers: &mut Numbers<'_>, dim: usize, contacts: usize) -> Result<Vec<(u32, u32, Block)>, ProblemError> {
    let (r, c) = (numbers.count("dense rows")?, numbers.count("dense columns")?);
    if r != dim * contacts || c != r {
        return Err(ProblemError::Format(format!("dense matrix {r}×{c} for {contacts} contacts")));
    }
    let mut out = Vec::new();
    for j in 0..contacts {
        let mut strip = vec![ZERO; contacts];
        for jj in 0..dim {
            for (i, b) in strip.iter_mut().enumerate() {
                for ii in 0..dim {
                    b[3 * ii + jj] = numbers.number("matrix entry")?;
                    let _ = i;
                }
            }
        }
        for (i, b) in strip.into_iter().enumerate() {
            if i == j || max_abs(&b) > 0.0 || b.iter().any(|v| v.is_nan()) {
                out.push((i as u32, j as u32, b));
            }
        }
    }
    Ok(out)
}

fn sparse(numbers: &mut Numbers<'_>, dim: usize, contacts: usize) -> Result<Vec<(u32, u32, Block)>, ProblemError> {
    let blocks = numbers.count("number of blocks")?;
    let rows = numbers.count("block rows")?;
    let cols = numbers.count("block columns")?;
    if rows != contacts || cols != contacts {
        return Err(ProblemError::Format(format!("{rows}×{cols} blocks for {contacts} contacts")));
    }
    for what in ["row end", "column end"] {
        for k in 0..contacts {
            if numbers.count(what)? != dim * (k + 1) {
                return Err(ProblemError::Format(format!("block {k} is not {dim}×{dim}")));
            }
        }
    }
    let f1 = numbers.count("length of row starts")?;
    let f2 = numbers.count("length of block columns")?;
    let mut starts = Vec::new();
    for _ in 0..f1 {
        starts.push(numbers.count("row start")?);
    }
    let mut columns = Vec::new();
    for _ in 0..f2 {
        let c = numbers.count("block column")?;
        columns.push(c);
    }
    let consistent = f1 <= contacts + 1
        && starts.windows(2).all(|w| w[0] <= w[1])
        && starts.last().is_none_or(|e| *e <= f2 && *e <= blocks)
        && starts.first().is_none_or(|s| *s == 0);
    if !consistent {
        return Err(ProblemError::Format("inconsistent block row starts".into()));
    }
    let mut out = Vec::new();
    for i in 0..f1.saturating_sub(1) {
        for p in starts[i]..starts[i + 1] {
            let j = columns[p];
            if j >= contacts {
                return Err(ProblemError::Format(format!("block column {j} of {contacts}")));
            }
            numbers.count("block number")?;
            let mut b = ZERO;
            for jj in 0..dim {
                for ii in 0..dim {
                    b[3 * ii + jj] = numbers.number("block entry")?;
                }
            }
            out.push((i as u32, j as u32, b));
        }
    }
    Ok(out)
}

/// Writes a problem in sparse-block storage. Cohesion has no place in this format: it is folded into `q` (the file
/// then states the problem of the shifted impulse).
#[must_use]
pub fn write(problem: &ContactProblem) -> String {
    let (d, n, w) = (problem.dimension, problem.len(), &problem.delassus);
    let mut s = String::new();
    let join = |v: &mut dyn Iterator<Item = usize>| v.map(|x| x.to_string()).collect::<Vec<_>>().join("\t");
    let _ = writeln!(s, "{d}\n{n}\n1\n{} {}\n{}\n{n} {n}", d * n, d * n, w.block_count());
    let ends = join(&mut (1..=n).map(|k| k * d));
    let mut starts = vec![0];
    for i in 0..n {
        starts.push(starts[i] + w.row(i).0.len());
    }
    let columns = join(&mut w.iter().map(|(_, j, _)| j));
    let _ = writeln!(s, "{ends}\n{ends}\n{} {}\n{}\n{columns}", n + 1, w.block_count(), join(&mut starts.into_iter()));
    for (p, (_, _, b)) in w.iter().enumerate() {
        let _ = writeln!(s, "{p}");
        for j in 0..d {
            for i in 0..d {
                let _ = write!(s, "{:e} ", b[3 * i + j]);
            }
        }
        s.push('\n');
    }
    for q in problem.shifted_velocity() {
        for v in &q[..d] {
            let _ = write!(s, "{v:e} ");
        }
    }
    s.push('\n');
    for nu in &problem.friction {
        let _ = write!(s, "{nu:e} ");
    }
    s.push('\n');
    s
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const TWO: &str = "3 2 0 6 6  6 6
        2 0 0 1 0 0   0 2 0 0 0 0   0 0 2 0 0 0   1 0 0 2 0 0   0 0 0 0 2 0   0 0 0 0 0.5 3
        -1 0.5 0 -2 0 1   0.3 0.4";

    #[test]
    fn dense_is_read_column_by_column_and_written_back() {
        let p = read(TWO).unwrap();
        assert_eq!((p.dimension, p.len()), (3, 2));
        // entry (row 4, column 5) is 0.5: block (1,1), row 1, column 2
        assert_eq!(p.delassus.diagonal(1), &[2.0, 0.0, 0.0, 0.0, 2.0, 0.5, 0.0, 0.0, 3.0]);
        assert_eq!(p.delassus.row(0).1[1][0], 1.0);
        assert_eq!(p.free_velocity[1], [-2.0, 0.0, 1.0]);
        assert_eq!(read(&write(&p)).unwrap(), p);
    }

    #[test]
    fn plane_problems_keep_their_dimension() {
        let p = read("2 1 0 2 2 2 2 1 0.5 0.5 3 -1 2 0.2").unwrap();
        assert_eq!(p.delassus.diagonal(0), &[1.0, 0.5, 0.0, 0.5, 3.0, 0.0, 0.0, 0.0, 2.0]);
        assert_eq!(read(&write(&p)).unwrap(), p);
    }

    proptest! {
        /// Any damage to a file is answered by an error, not by a panic.
        #[test]
        fn damaged_text_is_an_error_or_a_problem(cut in 0usize..250, word in "[-0-9.ex nNaA]{0,6}") {
            let good = write(&read(TWO).unwrap());
            let at = cut.min(good.len());
            let mut bad = good[..at].to_string();
            bad.push_str(&word);
            bad.push_str(&good[(at + word.len()).min(good.len())..]);
            let _ = read(&bad);
            let _ = read(&good[..at]);
        }
    }
}
