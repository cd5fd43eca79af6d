//! Which columns of a series belong in one plot, and how it is drawn.

/// One plot.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Group {
    pub title: String,
    pub unit: &'static str,
    pub logarithmic: bool,
    /// Columns of the table.
    pub columns: Vec<usize>,
}

/// Kinds of figures, in the order in which a person wants them; the first that fits takes the column.
const KINDS: [(&str, &str, bool, &[&str]); 14] = [
    ("Energy", "J", false, &["energy"]),
    ("Residuals and defects", "", true, &["residual", "defect", "error", "drift"]),
    ("Angular momentum", "kg m²/s", false, &["angular_momentum"]),
    ("Momentum", "kg m/s", false, &["momentum"]),
    ("Mass", "kg", false, &["mass"]),
    ("Iterations", "", false, &["iteration", "newton", "line_search"]),
    ("Torque", "N m", false, &["torque"]),
    ("Force", "N", false, &["force", "tension"]),
    ("Stress", "Pa", false, &["stress", "pressure"]),
    ("Power and work", "W, J", false, &["power", "work", "dissipat"]),
    ("Speed", "m/s", false, &["speed", "velocity"]),
    ("Contacts", "", false, &["contact", "stick", "slip", "open"]),
    ("Penetration and gap", "m", false, &["penetration", "gap"]),
    ("Volume", "m³", false, &["volume"]),
];

/// Lines in one plot at most.
const LINES: usize = 8;

/// Sorts columns into plots; `step`, `time`, `dt`, `limiter` and `rejections` are left to the caller.
pub(super) fn of(header: &[String]) -> Vec<Group> {
    let mut groups: Vec<Group> = Vec::new();
    let mut add = |title: &str, unit: &'static str, logarithmic: bool, column: usize| match groups
        .iter_mut()
        .find(|g| g.title == title && g.columns.len() < LINES)
    {
        Some(group) => group.columns.push(column),
        None => groups.push(Group { title: title.to_owned(), unit, logarithmic, columns: vec![column] }),
    };
    for (title, unit, logarithmic, words) in KINDS {
        for (k, name) in header.iter().enumerate() {
            if kind_of(name) == Some(title) {
                debug_assert!(words.iter().any(|w| name.contains(w)));
                add(title, unit, logarithmic, k);
            }
        }
    }
    for (k, name) in header.iter().enumerate() {
        if kind_of(name).is_none() && !["step", "time", "dt", "limiter", "rejections"].contains(&name.as_str()) {
            let words: Vec<&str> = name.split(['_', '.']).collect();
            let title =
                if name.starts_with("probe") && words.len() > 2 { words[..2].join(" ") } else { words[0].to_owned() };
            add(&title, "", false, k);
        }
    }
    groups
}

fn kind_of(name: &str) -> Option<&'static str> {
    if name.starts_with("probe") {
        return None;
    }
    KINDS.iter().find(|(_, _, _, words)| words.iter().any(|word| name.contains(word))).map(|kind| kind.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_find_their_plots() {
        let header: Vec<String> =
            "step,time,dt,limiter,rejections,iterations,kinetic_energy,elastic_energy,momentum_x,angular_momentum_x,\
            momentum_defect,probe_tip_x,probe_tip_y,height"
                .split(',')
                .map(str::to_owned)
                .collect();
        let groups = of(&header);
        let titles: Vec<(&str, usize)> = groups.iter().map(|g| (g.title.as_str(), g.columns.len())).collect();
        let expected = [
            ("Energy", 2),
            ("Residuals and defects", 1),
            ("Angular momentum", 1),
            ("Momentum", 1),
            ("Iterations", 1),
            ("probe tip", 2),
            ("height", 1),
        ];
        assert_eq!(titles, expected);
        let many: Vec<String> = (0..20).map(|i| format!("force_{i}")).collect();
        assert_eq!(of(&many).len(), 3);
    }
}
