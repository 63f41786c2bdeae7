//! Switches that the sources alone decide about: their states at the start need no solution.

use super::network::Assembly;
use crate::moreau::Switch;

/// Unknowns that follow from the sources `u` whatever the pairs do: rows without storage and pairs in
/// which one unknown is left, one after the other.
fn determined(sys: &Assembly, u: &[f64]) -> Vec<Option<f64>> {
    let n = sys.linear.g.nrows;
    let mut rows: Vec<Option<Vec<(usize, f64)>>> = vec![Some(Vec::new()); n];
    for (r, _, _) in sys.linear.e.iter().chain(sys.linear.a.iter()) {
        rows[r] = None;
    }
    for (r, c, v) in sys.linear.g.iter() {
        if let Some(row) = &mut rows[r] {
            row.push((c, v));
        }
    }
    let mut right = vec![0.0; n];
    sys.linear.s.mul_add(1.0, u, &mut right);
    let mut known = vec![None; n];
    let mut waiting: Vec<(usize, Vec<(usize, f64)>)> =
        rows.into_iter().enumerate().filter_map(|(r, row)| Some((r, row?))).collect();
    loop {
        let before = waiting.len();
        waiting.retain(|(r, row)| {
            let mut unknown = row.iter().filter(|e| known[e.0].is_none());
            let (Some(&(c, v)), None) = (unknown.next(), unknown.next()) else { return true };
            let others = row.iter().filter_map(|&(j, f)| Some(f * known[j]?)).sum::<f64>();
            known[c] = Some((right[*r] - others) / v);
            false
        });
        if waiting.len() == before {
            return known;
        }
    }
}

/// The state of each switch's control where the sources are `u`, from the states `before`; None if
/// that depends on more than sources.
pub fn by_sources(sys: &Assembly, switches: &[Switch], u: &[f64]) -> Option<Vec<bool>> {
    if switches.is_empty() {
        return Some(Vec::new());
    }
    let known = determined(sys, u);
    let z: Vec<f64> = known.iter().map(|v| v.unwrap_or(f64::NAN)).collect();
    switches
        .iter()
        .map(|switch| {
            let mut switch = switch.clone();
            let decided = switch.control.iter().all(|&(j, _)| known[j].is_some());
            switch.update(&z);
            decided.then_some(switch.closed)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::descriptor::Linear;
    use crate::sparse::Csc;

    /// Nodes 0 and 1 in series from ground, sources of 2 V and 3 V (currents 2 and 3), 1 Ohm from
    /// node 1 to node 4, which has a capacitor.
    #[test]
    fn chains_of_sources_are_followed() {
        let g = [
            (0, 2, 1.0),
            (0, 3, -1.0),
            (1, 3, 1.0),
            (1, 1, 1.0),
            (1, 4, -1.0),
            (2, 0, -1.0),
            (3, 0, 1.0),
            (3, 1, -1.0),
            (4, 1, -1.0),
            (4, 4, 1.0),
        ];
        let linear = Linear {
            e: Csc::from_triplets(5, 5, &[(4, 4, 1e-6)]),
            g: Csc::from_triplets(5, 5, &g),
            a: Csc::from_triplets(5, 0, &[]),
            b: Csc::from_triplets(0, 5, &[]),
            d: Csc::from_triplets(0, 0, &[]),
            q: Vec::new(),
            s: Csc::from_triplets(5, 2, &[(2, 0, -1.0), (3, 1, -1.0)]),
            row_kind: vec![0, 0, 1, 1, 0],
        };
        let sys =
            Assembly { linear, capacitors: vec![(4, -1, 1e-6)], conductors: vec![(1, 4, 1.0)] };
        let switch = |control: Vec<(usize, f64)>, closed| Switch {
            pair: 0,
            control,
            on_above: 4.5,
            off_below: 1.0,
            closed,
            inverted: false,
        };
        let high = switch(vec![(1, 1.0)], false); // 5 V
        let kept = switch(vec![(1, 1.0), (0, -1.0)], true); // 3 V: between the thresholds
        let low = switch(vec![(0, -1.0)], true);
        let u = [2.0, 3.0];
        let found = by_sources(&sys, &[high.clone(), kept, low], &u);
        assert_eq!(found, Some(vec![true, true, false]));
        assert_eq!(by_sources(&sys, &[high, switch(vec![(4, 1.0)], false)], &u), None);
        assert_eq!(by_sources(&sys, &[], &u), Some(vec![]));
    }
}
