//! The checks of the certificate as a Python class.

use super::linear::{has_shape, misfit, read, LinearSpec};
use super::{csc, invalid, tape, Floats, Matrix, SmoothSpec};
use crate::audit::{Auditor, Balance, Steps, Stretches, Sums, Taken};
use crate::moreau::Records;
use crate::newton::Smooth;
use numpy::{PyArray1, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;

#[pyclass(name = "Auditor", module = "nsspice._core")]
pub(super) struct PyAuditor {
    inner: Auditor,
    functions: usize,
    /// for the engine that is accompanied
    pub sums: Option<Sums>,
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
    #[new]
    fn new(
        linear: LinearSpec,
        averaging: Option<(Matrix, Matrix)>,
        smooth: Option<SmoothSpec>,
    ) -> PyResult<Self> {
        let linear = read(&linear)?;
        let (n, _, p) = linear.sizes();
        let smooth = match &smooth {
            Some((spec, f, q)) => Some(Smooth { tape: tape(spec, n, p)?, f: csc(f)?, q: csc(q)? }),
            None => None,
        };
        let averaging = match &averaging {
            Some((h, hs)) => Some((csc(h)?, csc(hs)?)),
            None => None,
        };
        let functions = smooth.as_ref().map_or(0, |s| s.tape.program().len());
        let fits = linear.row_kind.iter().all(|&k| k < 2)
            && averaging.iter().all(|(h, hs)| has_shape(h, n, n) && has_shape(hs, n, p))
            && smooth.iter().all(|s| [&s.f, &s.q].iter().all(|c| has_shape(c, n, functions)));
        if !fits {
            return Err(misfit());
        }
        Ok(PyAuditor {
            inner: Auditor::new(&linear, averaging.as_ref(), smooth.as_ref()),
            functions,
            sums: Sums::new(&linear, averaging.as_ref(), smooth.as_ref()),
        })
    }

    /// Checks recorded steps, `nsspice.solvers.moreau.Records`.
    #[pyo3(signature = (records, frozen=None))]
    fn take_steps(&mut self, records: &Bound<'_, PyAny>, frozen: Option<f64>) -> PyResult<()> {
        let floats = |name: &str| part::<f64>(records, name);
        let (time, length) = (floats("time")?, floats("length")?);
        let (z, change, l) = (floats("z")?, floats("change")?, floats("lam")?);
        let (u, du) = (floats("u")?, floats("source_change")?);
        let roles = match records.getattr("roles")? {
            none if none.is_none() => None,
            _ => Some(part::<u8>(records, "roles")?),
        };
        let steps = Steps {
            time: time.as_slice()?,
            length: length.as_slice()?,
            z: z.as_slice()?,
            change: change.as_slice()?,
            l: l.as_slice()?,
            u: u.as_slice()?,
            source_change: du.as_slice()?,
            roles: roles.as_ref().map_or(Ok(&[][..]), |r| r.as_slice())?,
            frozen,
        };
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
        self.inner.take_steps(&steps);
        Ok(())
    }

    /// Checks recorded stretches, `nsspice.solvers.stretches.Stretches`.
    fn take_stretches(&mut self, records: &Bound<'_, PyAny>) -> PyResult<()> {
        let floats = |name: &str| part::<f64>(records, name);
        let known: f64 = records.getattr("known")?.extract()?;
        let (begin, end) = (floats("begin")?, floats("end")?);
        let (grain, swing) = (floats("grain")?, floats("swing")?);
        let (seam_end, seam_begin) = (floats("seam_end")?, floats("seam_begin")?);
        let (done, signed) = (part::<u8>(records, "steps")?, part::<u8>(records, "signed")?);
        let (first, first_u) = (floats("first")?, floats("first_u")?);
        let (time, weight, inner) = (floats("time")?, floats("weight")?, floats("inner")?);
        let (z, rate, l, u) = (floats("z")?, floats("rate")?, floats("lam")?, floats("u")?);
        let function_rate = floats("function_rate")?;
        let roles = part::<u8>(records, "roles")?;
        let all = Stretches {
            nodes: time.shape().get(1).copied().unwrap_or(0),
            known,
            begin: begin.as_slice()?,
            end: end.as_slice()?,
            grain: grain.as_slice()?,
            swing: swing.as_slice()?,
            steps: done.as_slice()?,
            signed: signed.as_slice()?,
            first: first.as_slice()?,
            first_u: first_u.as_slice()?,
            time: time.as_slice()?,
            weight: weight.as_slice()?,
            inner: inner.as_slice()?,
            z: z.as_slice()?,
            rate: rate.as_slice()?,
            l: l.as_slice()?,
            u: u.as_slice()?,
            function_rate: function_rate.as_slice()?,
            roles: roles.as_slice()?,
            seam_end: seam_end.as_slice()?,
            seam_begin: seam_begin.as_slice()?,
        };
        let (n, m, p) = self.inner.sizes();
        let (k, nodes) = (all.begin.len(), all.nodes);
        let points = k * nodes;
        let either = |len: usize, full: usize| len == 0 || len == full;
        let fits = [all.end.len(), all.grain.len(), all.swing.len()] == [k; 3]
            && [all.steps.len(), all.signed.len()] == [k; 2]
            && all.seam_end.len() == all.seam_begin.len()
            && all.seam_end.len().is_multiple_of(n.max(1))
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
        self.inner.take_stretches(&all);
        Ok(())
    }

    /// Relative error of the balance of charge and flux over a jump.
    #[allow(clippy::too_many_arguments)] // all of what is known of it
    fn jump_error(
        &mut self,
        moved: Floats,
        stored: Floats,
        before: Floats,
        after: Floats,
        lengths: (f64, f64, f64, f64),
        sources: Floats,
        unknowns: Floats,
        multipliers: Floats,
    ) -> PyResult<f64> {
        let (n, m, p) = self.inner.sizes();
        let lists = [&moved, &stored, &before, &after, &unknowns];
        let [moved, stored, before, after, unknowns] = lists.map(|a| a.as_slice());
        let (moved, stored, sides, unknowns) = (moved?, stored?, [before?, after?], unknowns?);
        let (sources, multipliers) = (sources.as_slice()?, multipliers.as_slice()?);
        let [before, after] = sides.map(<[f64]>::len);
        let all_n = [moved.len(), stored.len(), before, after, unknowns.len()] == [n; 5];
        if !all_n || multipliers.len() != m || sources.len() != p {
            return Err(invalid("the jump does not fit the system"));
        }
        Ok(self.inner.jump_error(
            moved,
            stored,
            sides,
            lengths.into(),
            sources,
            unknowns,
            multipliers,
        ))
    }

    /// Takes the energies of a jump [J].
    fn jump(&mut self, time: f64, before: f64, after: f64, delivered: f64) {
        if let Some(ledger) = &mut self.inner.ledger {
            ledger.jump(time, before, after, delivered);
        }
    }

    /// The worst errors, where, and the energies.
    fn result<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let out = PyDict::new(py);
        out.set_item("laws", self.inner.laws)?;
        out.set_item("complementarity", self.inner.complementarity)?;
        out.set_item("worst_row", self.inner.worst_row)?;
        out.set_item("worst_pair", self.inner.worst_pair)?;
        out.set_item("checks", self.inner.checks)?;
        out.set_item("seams", self.inner.seams.error())?;
        if let Some(ledger) = &self.inner.ledger {
            let e = &ledger.energy;
            let energy = PyDict::new(py);
            energy.set_item("stored", e.stored)?;
            energy.set_item("delivered", e.delivered)?;
            energy.set_item("dissipated", e.dissipated)?;
            energy.set_item("lost", e.lost)?;
            energy.set_item("scheme", e.scheme)?;
            energy.set_item("imbalance", e.imbalance)?;
            energy.set_item("steps", e.steps)?;
            out.set_item("energy", energy)?;
            out.set_item("drift", ledger.drift())?;
            let [stored, delivered] = ledger.in_jumps();
            out.set_item("jumps_stored", stored)?;
            out.set_item("jumps_delivered", delivered)?;
        }
        Ok(out)
    }
}

/// The balance of energy over a run as a dict.
pub(super) fn balance_dict<'py>(py: Python<'py>, b: &Balance) -> PyResult<Bound<'py, PyDict>> {
    let out = PyDict::new(py);
    out.set_item("stored", b.stored)?;
    out.set_item("delivered", b.delivered)?;
    out.set_item("dissipated", b.dissipated)?;
    out.set_item("scheme", b.scheme)?;
    out.set_item("drift", b.drift)?;
    out.set_item("steps", b.steps)?;
    Ok(out)
}

/// Recorded steps as a dict of flat arrays.
pub(super) fn record_dict<'py>(py: Python<'py>, r: &Records) -> PyResult<Bound<'py, PyDict>> {
    let out = PyDict::new(py);
    for (name, values) in [
        ("time", &r.time),
        ("length", &r.length),
        ("z", &r.z),
        ("change", &r.change),
        ("lam", &r.l),
        ("u", &r.u),
        ("source_change", &r.source_change),
    ] {
        out.set_item(name, PyArray1::from_slice(py, values))?;
    }
    out.set_item("roles", PyArray1::from_slice(py, &r.roles))?;
    Ok(out)
}

/// Recorded stretches as a dict of flat arrays.
pub(super) fn stretch_dict<'py>(py: Python<'py>, taken: &Taken) -> PyResult<Bound<'py, PyDict>> {
    let out = PyDict::new(py);
    out.set_item("nodes", taken.nodes)?;
    out.set_item("known", taken.known)?;
    out.set_item("seams", taken.seams)?;
    for (name, values) in [
        ("begin", &taken.begin),
        ("end", &taken.end),
        ("grain", &taken.grain),
        ("swing", &taken.swing),
        ("seam_end", &taken.seam_end),
        ("seam_begin", &taken.seam_begin),
        ("first", &taken.first),
        ("first_u", &taken.first_u),
        ("time", &taken.time),
        ("weight", &taken.weight),
        ("inner", &taken.inner),
        ("z", &taken.z),
        ("rate", &taken.rate),
        ("lam", &taken.l),
        ("u", &taken.u),
        ("function_rate", &taken.function_rate),
    ] {
        out.set_item(name, PyArray1::from_slice(py, values))?;
    }
    for (name, values) in
        [("steps", &taken.steps), ("signed", &taken.signed), ("roles", &taken.roles)]
    {
        out.set_item(name, PyArray1::from_slice(py, values))?;
    }
    Ok(out)
}
