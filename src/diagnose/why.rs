//! Why a reading is, or is not, the verdict.

use super::refit::End;
use super::select::Selection;
use super::verdict::Judged;

impl Judged {
    /// Why one of the readings tried is, or is not, the verdict.
    pub(super) fn why(&self, selection: &Selection, tried: usize) -> String {
        if let Some(near) = self.near.filter(|near| near.reading == tried) {
            return near.why();
        }
        let chosen = selection.chosen.map(|i| &selection.tried[i]);
        let own = &selection.tried[tried];
        let gain = selection.base.cost - own.fitted.cost;
        match chosen {
            Some(_) if selection.chosen == Some(tried) && !self.verdict.explained_by.is_empty() => {
                "nothing explains as much with as little, but it is in no catalogue".to_owned()
            }
            Some(_) if selection.chosen == Some(tried) && self.verdict.unexplained => {
                "it comes closest of what can be believed, but leaves too much or is hardly told from others"
                    .to_owned()
            }
            Some(_) if selection.chosen == Some(tried) => {
                "nothing explains as much with as little".to_owned()
            }
            Some(_) if own.fitted.end == End::GivenUp => {
                "given up: it could not have come close to what explains more".to_owned()
            }
            Some(chosen)
                if self.whole.is_some() && chosen.physics.iter().all(|p| own.physics.contains(p)) =>
            {
                "whether something acts besides is not settled".to_owned()
            }
            Some(chosen) if self.mispredict.contains(&tried) => {
                let best = selection.base.cost - chosen.fitted.cost;
                format!(
                    "it removes {:.0} % of what the verdict removes, but predicts pokes that it has not seen worse",
                    100.0 * gain / best
                )
            }
            Some(chosen) if own.fitted.cost < chosen.fitted.cost => {
                "what it adds is no more than chance or elements can".to_owned()
            }
            Some(chosen) => {
                let best = selection.base.cost - chosen.fitted.cost;
                format!("it removes {:.0} % of what the verdict removes", 100.0 * gain / best)
            }
            None => "what it adds is no more than chance or elements can".to_owned(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::nearest::Nearest;
    use super::super::physics::Physics;
    use super::super::rivals::tests::selection;
    use super::super::verdict::tests::judged;
    use super::*;

    /// Where nothing is called, what is told to come near is not dismissed among the candidates, whatever was chosen and explains nothing.
    #[test]
    fn what_may_act_weakly_is_not_dismissed() {
        let near = Nearest { reading: 1, physics: Physics::Drying, share: 0.7 };
        let nothing = Judged { near: Some(near), ..judged(&[], 0.5) };
        for chosen in [None, Some(0), Some(1)] {
            let selection = Selection { chosen, ..selection() };
            assert!(nothing.why(&selection, 1).contains("70 % of what is asked of it"), "{chosen:?}");
            assert!(!nothing.why(&selection, 3).contains("asked"), "{chosen:?}");
        }
        let unchosen = Selection { chosen: None, ..selection() };
        assert!(nothing.why(&unchosen, 3).contains("no more than chance"));
    }
}
