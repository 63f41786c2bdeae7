//! The checks of the certificate as a Python class.

use super::points::{PyIntervals, PyRecords};
use super::system::{misfit, PySystem};
use super::{invalid, Floats, Matrix, TurnSpec};
use crate::audit::{Auditor, Balance, Between, Gates, SegmentPoints, Sources, Steps, Sums, Taken};
use crate::structure::Coordinates;
use crate::switch::Turn;
use numpy::{PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::PyDict;

#[pyclass(name = "Auditor", module = "nsspice._core")]
pub(super) struct PyAuditor {
    inner: Auditor,
    functions: usize,
    /// the voltages that are unknowns of the engine, if they are no potentials
    tree: Option<Coordinates>,
    /// for the engine that is accompanied
    pub sums: Option<Sums>,
    /// for the exact engine: all of its segments
    pub points: Option<SegmentPoints>,
}

/// An array among the attributes of an object.
fn part<'py, T>(object: &Bound<'py, PyAny>, name: &str) -> PyResult<PyReadonlyArrayDyn<'py, T>>
where
    T: numpy::Element,
{
    let item = object.getattr(name)?;
    item.extract().map_err(|_| invalid(format!("{name} is no array of its type")))
}

#[pymethods]
impl PyAuditor {
    /// `timed`: what is recorded belongs to instants, at which sources have the values of their
    /// waveforms.
    #[new]
    fn new(system: &PySystem, averaging: Option<(Matrix, Matrix)>, timed: bool) -> PyResult<Self> {
        let [.., functions] = system.sizes();
        let smooth = system.smooth.as_ref();
        let averaging = system.averaging(&averaging)?;
        let between = Between {
            capacitors: &system.capacitors,
            conductors: &system.conductors,
            coordinates: &system.coordinates,
        };
        let sums = Sums::new(&system.linear, between, averaging.as_ref(), smooth);
        // the laws are checked in node voltages, regardless of the coordinates in which they were solved
        let tree = (!system.coordinates.are_potentials()).then(|| system.coordinates.clone());
        let turned = tree.as_ref().map(|tree| {
            let terms = averaging.as_ref().map(|(h, hs)| tree.averaging_at_nodes([h, hs]));
            (tree.at_nodes_of(&system.linear, &system.capacitors, &system.conductors), terms)
        });
        let (linear, averaging) =
            turned.as_ref().map_or((&system.linear, &averaging), |(linear, terms)| (linear, terms));
        let at_nodes = tree.as_ref().zip(smooth).map(|(tree, smooth)| tree.smooth_at_nodes(smooth));
        let mut inner = Auditor::new(
            linear,
            [between.capacitors, between.conductors],
            averaging.as_ref(),
            at_nodes.as_ref().or(smooth),
        );
        if let Some(tree) = &tree {
            inner.know_tree(tree);
        }
        if timed {
            if system.described.len() != linear.s.ncols {
                return Err(misfit());
            }
            inner.sources = Some(Sources::new(&system.described));
        }
        let points = (timed && smooth.is_none()).then(|| {
            SegmentPoints::new(&system.linear, system.switches.clone(), &system.described)
        });
        if !system.switches.is_empty() {
            let mut switches = system.switches.clone();
            if let Some(tree) = &tree {
                let mut own = switches.to_vec();
                own.iter_mut().for_each(|s| s.control = tree.list_at_nodes(&s.control));
                switches = own.into();
            }
            inner.gates = Some(Gates::new(switches));
        }
        Ok(PyAuditor { inner, functions, tree, sums, points })
    }

    /// Checks recorded steps as an engine left them, or `nsspice.solvers.moreau.Records`.
    #[pyo3(signature = (records, frozen=None))]
    fn take_steps(&mut self, records: &Bound<'_, PyAny>, frozen: Option<f64>) -> PyResult<()> {
        if let Ok(own) = records.cast::<PyRecords>() {
            let r = &own.get().records;
            return self.steps(&Steps {
                time: &r.time,
                length: &r.length,
                z: &r.z,
                change: &r.change,
                l: &r.l,
                u: &r.u,
                source_change: &r.source_change,
                roles: &r.roles,
                frozen,
            });
        }
        let floats = |name: &str| part::<f64>(records, name);
        let (time, length) = (floats("time")?, floats("length")?);
        let (z, change, l) = (floats("z")?, floats("change")?, floats("lam")?);
        let (u, du) = (floats("u")?, floats("source_change")?);
        let roles = match records.getattr("roles")? {
            none if none.is_none() => None,
            _ => Some(part::<u8>(records, "roles")?),
        };
        self.steps(&Steps {
            time: time.as_slice()?,
            length: length.as_slice()?,
            z: z.as_slice()?,
            change: change.as_slice()?,
            l: l.as_slice()?,
            u: u.as_slice()?,
            source_change: du.as_slice()?,
            roles: roles.as_ref().map_or(Ok(&[][..]), |r| r.as_slice())?,
            frozen,
        })
    }

    /// Checks recorded intervals as an engine left them, or `nsspice.solvers.intervals.Intervals`.
    fn take_intervals(&mut self, records: &Bound<'_, PyAny>) -> PyResult<()> {
        if let Ok(own) = records.cast::<PyIntervals>() {
            return self.intervals(&own.get().taken);
        }
        let floats = |name: &str| -> PyResult<Vec<f64>> {
            Ok(part::<f64>(records, name)?.as_slice()?.to_vec())
        };
        let bytes = |name: &str| -> PyResult<Vec<u8>> {
            Ok(part::<u8>(records, name)?.as_slice()?.to_vec())
        };
        let time = part::<f64>(records, "time")?;
        self.intervals(&Taken {
            nodes: time.shape().get(1).copied().unwrap_or(0),
            known: records.getattr("known")?.extract()?,
            time: time.as_slice()?.to_vec(),
            l: floats("lam")?,
            steps: bytes("steps")?,
            signed: bytes("signed")?,
            roles: bytes("roles")?,
            begin: floats("begin")?,
            end: floats("end")?,
            shortest: floats("shortest")?,
            swing: floats("swing")?,
            doubt: floats("doubt")?,
            first: floats("first")?,
            first_u: floats("first_u")?,
            weight: floats("weight")?,
            inner: floats("inner")?,
            z: floats("z")?,
            rate: floats("rate")?,
            u: floats("u")?,
            function_rate: floats("function_rate")?,
            boundary_end: floats("boundary_end")?,
            boundary_begin: floats("boundary_begin")?,
            boundaries: 0,
        })
    }

    /// Takes gates that have turned: time, switch, the gate before, its control, what the pair carried, whether located;
    /// and the tolerance to which instants are known.
    fn take_turns(&mut self, turns: Vec<TurnSpec>, tolerance: f64) {
        let turn = |(time, switch, gate, control, carried, located)| Turn {
            time,
            switch,
            gate,
            control,
            carried,
            located,
        };
        self.inner.take_turns(&turns.into_iter().map(turn).collect::<Vec<_>>(), tolerance);
    }

    /// Relative error of the balance of charge and flux over a jump.
    #[allow(clippy::too_many_arguments)] // all of what is known of it
    fn jump_error(
        &mut self,
        moved: Floats,
        stored: Floats,
        before: Floats,
        after: Floats,
        lengths: (f64, f64, f64),
        sources: Floats,
        unknowns: Floats,
        multipliers: Floats,
        functions: Floats,
        gave: Option<f64>,
    ) -> PyResult<f64> {
        let (n, m, p) = self.inner.sizes();
        let lists = [&moved, &stored, &before, &after, &unknowns];
        let [moved, stored, before, after, unknowns] = lists.map(|a| a.as_slice());
        let (moved, stored, sides, unknowns) = (moved?, stored?, [before?, after?], unknowns?);
        let (sources, multipliers) = (sources.as_slice()?, multipliers.as_slice()?);
        let functions = functions.as_slice()?;
        let [before, after] = sides.map(<[f64]>::len);
        let all_n = [moved.len(), stored.len(), before, after, unknowns.len()] == [n; 5];
        let fit = functions.len() == self.inner.functions();
        if !all_n || multipliers.len() != m || sources.len() != p || !fit {
            return Err(invalid("the jump does not fit the system"));
        }
        let at_nodes = |list: &[f64]| {
            self.tree.as_ref().map_or_else(|| list.to_vec(), |tree| tree.at_nodes(list))
        };
        let potentials = |list: &[f64]| {
            self.tree.as_ref().map_or_else(|| list.to_vec(), |tree| tree.potentials(list))
        };
        let [moved, stored] = [moved, stored].map(at_nodes);
        let [before, after, unknowns] = [sides[0], sides[1], unknowns].map(potentials);
        let (moved, stored, sides, unknowns) =
            (&moved, &stored, [&before[..], &after], &unknowns[..]);
        Ok(self.inner.jump_error(
            moved,
            stored,
            sides,
            lengths.into(),
            sources,
            [unknowns, multipliers, functions],
            gave,
        ))
    }

    /// The worst errors, and where.
    fn result<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let out = PyDict::new(py);
        out.set_item(intern!(py, "laws"), self.inner.found.laws)?;
        out.set_item(intern!(py, "complementarity"), self.inner.found.complementarity)?;
        out.set_item(intern!(py, "worst_row"), self.inner.found.worst_row)?;
        out.set_item(intern!(py, "worst_pair"), self.inner.found.worst_pair)?;
        out.set_item(intern!(py, "checks"), self.inner.found.checks)?;
        out.set_item(intern!(py, "boundaries"), self.inner.boundaries.error())?;
        if let Some(sources) = &self.inner.sources {
            out.set_item(intern!(py, "sources"), sources.error)?;
            out.set_item(intern!(py, "worst_source"), sources.worst)?;
        }
        if let Some(gates) = &self.inner.gates {
            out.set_item(intern!(py, "gates"), gates.error)?;
            out.set_item(intern!(py, "worst_gate"), gates.worst)?;
        }
        out.set_item(intern!(py, "steps"), self.inner.found.steps)?;
        Ok(out)
    }
}

impl PyAuditor {
    fn steps(&mut self, steps: &Steps) -> PyResult<()> {
        let (n, m, p) = self.inner.sizes();
        let k = steps.time.len();
        let fits = steps.length.len() == k
            && [steps.z.len(), steps.change.len()] == [k * n; 2]
            && steps.l.len() == k * m
            && [steps.u.len(), steps.source_change.len()] == [k * p; 2]
            && (steps.roles.is_empty() || steps.roles.len() == k * m);
        if !fits {
            return Err(invalid("the recorded arrays do not fit the system"));
        }
        let Some(tree) = &self.tree else {
            self.inner.take_steps(steps);
            return Ok(());
        };
        let [z, change] = [steps.z, steps.change].map(|list| tree.all_potentials(list));
        self.inner.take_steps(&Steps { z: &z, change: &change, ..*steps });
        Ok(())
    }

    fn intervals(&mut self, all: &Taken) -> PyResult<()> {
        let (n, m, p) = self.inner.sizes();
        let (k, nodes) = (all.begin.len(), all.nodes);
        let points = k * nodes;
        let either = |len: usize, full: usize| len == 0 || len == full;
        let fits = [all.end.len(), all.shortest.len(), all.swing.len(), all.doubt.len()] == [k; 4]
            && [all.steps.len(), all.signed.len()] == [k; 2]
            && all.boundary_end.len() == all.boundary_begin.len()
            && all.boundary_end.len().is_multiple_of(n.max(1))
            && all.first.len() == k * n
            && all.first_u.len() == k * p
            && [all.time.len(), all.weight.len()] == [points; 2]
            && either(all.inner.len(), points * nodes)
            && [all.z.len(), all.rate.len()] == [points * n; 2]
            && all.l.len() == points * m
            && all.u.len() == points * p
            && all.function_rate.len() == points * self.functions
            && either(all.roles.len(), k * m);
        if !fits {
            return Err(invalid("the recorded arrays do not fit the system"));
        }
        let Some(tree) = &self.tree else {
            self.inner.take_intervals(all);
            return Ok(());
        };
        let lists = [&all.first, &all.z, &all.rate, &all.boundary_end, &all.boundary_begin];
        let [first, z, rate, boundary_end, boundary_begin] =
            lists.map(|list| tree.all_potentials(list));
        self.inner.take_intervals(&Taken {
            first,
            z,
            rate,
            boundary_end,
            boundary_begin,
            ..all.clone()
        });
        Ok(())
    }
}

/// What was found in the segments of a run, as a dict.
pub(super) fn points_dict<'py>(
    py: Python<'py>,
    points: &SegmentPoints,
) -> PyResult<Bound<'py, PyDict>> {
    let out = PyDict::new(py);
    out.set_item(intern!(py, "points"), points.count)?;
    out.set_item(intern!(py, "judged"), points.judged)?;
    out.set_item(intern!(py, "factorised"), points.factorised())?;
    out.set_item(intern!(py, "complementarity"), points.complementarity)?;
    out.set_item(intern!(py, "worst_pair"), points.worst_pair)?;
    out.set_item(intern!(py, "gates"), points.gates)?;
    out.set_item(intern!(py, "worst_gate"), points.worst_gate)?;
    out.set_item(intern!(py, "sources"), points.sources.error)?;
    out.set_item(intern!(py, "worst_source"), points.sources.worst)?;
    Ok(out)
}

/// The balance of energy over a run as a dict.
pub(super) fn balance_dict<'py>(py: Python<'py>, b: &Balance) -> PyResult<Bound<'py, PyDict>> {
    let out = PyDict::new(py);
    out.set_item(intern!(py, "stored"), b.stored)?;
    out.set_item(intern!(py, "delivered"), b.delivered)?;
    out.set_item(intern!(py, "dissipated"), b.dissipated)?;
    out.set_item(intern!(py, "scheme"), b.scheme)?;
    out.set_item(intern!(py, "instants"), b.instants)?;
    out.set_item(intern!(py, "turned"), b.turned)?;
    out.set_item(intern!(py, "drift"), b.drift)?;
    out.set_item(intern!(py, "steps"), b.steps)?;
    out.set_item(intern!(py, "step_error"), b.step_error)?;
    out.set_item(intern!(py, "unreported"), b.unreported)?;
    Ok(out)
}
