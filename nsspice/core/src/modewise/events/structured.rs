//! The mode from the structure of the network, by closed forms of the jump and of what follows it.

use crate::instant::Before;
use crate::modewise::events::successor::{roles, settle, Picked, Picker, Scene, StateJump};
use crate::modewise::events::verify::{Finding, Scale};
use crate::modewise::modes::implicit_step::Implicit;
use crate::modewise::modes::registry::Registry;
use crate::modewise::segments::trajectory::Trajectory;

impl Picker {
    /// The mode that the network enters right after this instant, with the jump that leads there; `a` moves to
    /// where the jump leads.  Nothing if the structure is not known, or if the mode does not prove right.
    #[allow(clippy::too_many_arguments)] // the ingredients of a choice
    pub(in crate::modewise) fn by_structure(
        &mut self,
        scene: &Scene,
        registry: &mut Registry,
        gates: &[bool],
        a: &mut [f64],
        scale: &mut Scale,
        path: &mut Trajectory,
    ) -> Option<Picked> {
        let reinitialiser = scene.prepared.reinitialiser.as_ref()?;
        let (segment, inputs) = (scene.segment, &scene.prepared.inputs);
        let count = inputs.waveforms().len();
        let u: Vec<f64> = (0..count).map(|k| inputs.value_of(k, &segment.now)).collect();
        let slopes: Vec<f64> = (0..count).map(|k| inputs.rate_of(k, &segment.rate)).collect();
        let mut charges = vec![0.0; scene.prepared.net.n];
        scene.prepared.net.charges.apply(a, &mut charges);
        let roles = roles(scene.prepared.net.m, &scene.prepared.switches, gates);
        let found = reinitialiser.after(Before::Stored(&charges), [&u, &slopes], &roles, 0.0)?;
        let mut now = a.to_vec();
        self.state_jumps.clear();
        let through = found.through;
        let id = registry.id(&found.active, gates);
        if through != found.active {
            // charges pass pairs that block afterwards
            let first = registry.id(&through, gates);
            let mode = registry.mode(first, &scene.prepared.net, &scene.prepared.switches).ok()?;
            self.state_jumps.push(StateJump { through: first, before: now.clone() });
            settle(&mode, &segment.now, &mut now);
        }
        let picked = match self.attempt(scene, registry, id, &now, scale, path) {
            Ok(mode) => Some(Picked { id, mode }),
            Err(Finding::Guard(..) | Finding::Signs) => {
                self.neighbours(scene, registry, id, gates, &now, scale, path)
            }
            Err(_) => None,
        };
        match &picked {
            Some(_) => a.copy_from_slice(&now),
            None => self.state_jumps.clear(),
        }
        picked
    }

    /// The mode from here on where none is known that follows: by the structure of the network, else by implicit
    /// steps.
    #[allow(clippy::too_many_arguments)]
    pub(in crate::modewise) fn afresh(
        &mut self,
        scene: &Scene,
        registry: &mut Registry,
        implicit: &mut Implicit,
        fastest: f64,
        gates: &[bool],
        a: &mut [f64],
        scale: &mut Scale,
        path: &mut Trajectory,
    ) -> Option<Picked> {
        self.by_structure(scene, registry, gates, a, scale, path)
            .or_else(|| self.by_steps(scene, registry, implicit, fastest, gates, a, scale, path))
    }
}
