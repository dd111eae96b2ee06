//! Pairs without a right answer are told, not aligned: another character's print, a mirrored mesh, a plate without
//! carving.

use mocban::demo::{Decoy, DecoyPair, Pairs, Tier};
use mocban::raster;
use mocban::stages::{AlignedPair, Settings, StageError};
use rayon::prelude::*;

use crate::semi_real::settings;

/// Pairs of each kind and tier.
const COUNT: u64 = 3;

fn refusal(decoy: &DecoyPair, settings: &Settings) -> Result<(), StageError> {
    let print = raster::decode(&decoy.print, &raster::Limits::SUGGESTED).expect("a picture");
    AlignedPair::new(&decoy.mesh.clone().into(), &print.into(), settings)?;
    Ok(())
}

#[test]
fn pairs_that_do_not_belong_together_are_refused() {
    let settings = settings();
    let cases: Vec<(Tier, Decoy, u64)> = [Tier::Upright, Tier::Pose]
        .into_iter()
        .flat_map(|tier| Decoy::ALL.map(|kind| (tier, kind)))
        .flat_map(|(tier, kind)| (0..COUNT).map(move |index| (tier, kind, index)))
        .collect();
    let taken: Vec<String> = cases
        .into_par_iter()
        .filter_map(|(tier, kind, index)| {
            let decoy = Pairs::new(tier, 77)
                .decoy(kind, index)
                .expect("a decoy is made");
            let name = format!("{tier} {index}: {}", kind.name());
            refusal(&decoy, &settings).is_ok().then_some(name)
        })
        .collect();
    assert!(
        taken.is_empty(),
        "aligned all the same: {}",
        taken.join(", ")
    );
}
