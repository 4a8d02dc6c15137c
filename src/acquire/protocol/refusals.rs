//! Does a protocol mean what it says, and is every slip refused with the words that help?

use super::*;
use crate::acquire::AcquireError;

const FIVE: &str = include_str!("../../../rigs/protocols/five-pokes.toml");
const GRID: &str = include_str!("../../../rigs/protocols/grid-and-cycles.toml");

const HEAD: &str = "format = \"phantom-protocol/1\"\nname = \"n\"\n";

fn parse(body: &str) -> Result<Protocol, AcquireError> {
    Protocol::parse("p.toml", &format!("{HEAD}{body}"), &[])
}

fn step(body: &str) -> Result<Protocol, AcquireError> {
    parse(&format!("[[step]]\n{body}"))
}

fn refusal(parsed: Result<Protocol, AcquireError>) -> String {
    parsed.expect_err("refused").to_string()
}

fn strokes(protocol: &Protocol) -> Vec<([f64; 3], Stroke)> {
    let stroke = |step: PlannedStep| match step.action {
        Action::Stroke { site_m, stroke } => Some((site_m, stroke)),
        _ => None,
    };
    protocol.expand().into_iter().filter_map(stroke).collect()
}

#[test]
fn the_examples_mean_what_they_say() {
    let five = Protocol::parse("five-pokes.toml", FIVE, &[]).expect("sound");
    assert_eq!((five.name(), five.steps().len()), ("five pokes", 7));
    let made = strokes(&five);
    assert_eq!(made.len(), 5);
    let (site_m, stroke) = made[0];
    assert_eq!(site_m, [0.05, 0.075, 0.025]);
    assert_eq!((stroke.speed_m_s, stroke.retreat_speed_m_s, stroke.pause_s), (0.002, 0.004, 2.0));
    assert_eq!(stroke.profile, Profile::Press { target: Target::Depth { depth_m: 0.003 }, hold_s: 0.5 });
    assert_eq!((made[4].1.speed_m_s, made[4].1.direction), (5e-4, None));

    let grid = Protocol::parse("grid-and-cycles.toml", GRID, &[]).expect("sound");
    let steps = grid.expand();
    assert_eq!(steps.iter().filter(|s| s.poke.is_some()).count(), 14 + 2 + 1 + 1);
    assert_eq!(steps.iter().filter(|s| s.kind == Kind::Air).count(), 3);
    assert!(steps.iter().zip(1..).all(|(step, number)| step.number == number));
}

#[test]
fn a_variable_is_replaced_from_outside_and_nothing_else_is() {
    let set = |name: &str, value| vec![(name.to_owned(), value)];
    let deep = Protocol::parse("f", FIVE, &set("deep_mm", 3.5)).expect("sound");
    let plain = Protocol::parse("f", FIVE, &[]).expect("sound");
    let depths = |p: &Protocol| strokes(p).iter().map(|(_, s)| s.deepest_m() * 1e3).collect::<Vec<_>>();
    assert_eq!(depths(&plain), [3.0, 3.0, 3.0, 1.5, 3.0]);
    assert_eq!(depths(&deep), [3.5, 3.5, 3.5, 1.5, 3.5]);
    let overridden: Vec<&str> =
        deep.variables().iter().filter(|v| v.overridden).map(|v| v.name.as_str()).collect();
    assert_eq!(overridden, ["deep_mm"]);

    let unknown = refusal(Protocol::parse("f.toml", FIVE, &set("depp_mm", 3.5)));
    for words in ["f.toml:7:", "depp_mm is set to 3.5", "did you mean deep_mm?", "shallow_mm"] {
        assert!(unknown.contains(words), "{words}: {unknown}");
    }
    // The value is checked where it is used.
    let wrong = refusal(Protocol::parse("f.toml", FIVE, &set("deep_mm", -1.0)));
    assert!(
        wrong.contains("depth_mm = \"$deep_mm\", which is -1; expected a number of mm from 0.001"),
        "{wrong}"
    );
    let no_number = refusal(Protocol::parse("f.toml", FIVE, &set("deep_mm", f64::NAN)));
    assert!(no_number.contains("deep_mm = NaN; expected a number of mm"), "{no_number}");
}

#[test]
fn every_slip_is_refused_with_place_key_value_and_expectation() {
    let poke = "kind = \"poke\"\nsite_mm = [50, 75, 25]\nspeed_mm_s = 2\ndepth_mm = 3\n";
    let cases: &[(&str, &[&str])] = &[
        ("kind = \"pok\"", &["p.toml:4:8: step 1: kind = \"pok\"", "\"ask\"", "did you mean \"poke\"?"]),
        ("site_mm = [1, 2, 3]", &["step 1: kind is missing; expected one of \"poke\""]),
        (
            &format!("{poke}speed_mm = 4"),
            &["p.toml:8:1: step 1 (poke): speed_mm = 4", "did you mean speed_mm_s?"],
        ),
        (&format!("{poke}speed = 4"), &["did you mean speed_mm_s?", "one of kind, site_mm, depth_mm"]),
        (&format!("{poke}colour = 4"), &["colour = 4; there is no such key; expected one of"]),
        (
            &format!("{poke}hold_s = -1"),
            &["p.toml:8:10: step 1 (poke): hold_s = -1; expected a number of s from 0 to 86400"],
        ),
        (&format!("{poke}hold_s = true"), &["hold_s = true; expected a number"]),
        (&format!("{poke}hold_s = \"2\""), &["hold_s = \"2\"; expected a number", "\"$variable\""]),
        (&format!("{poke}hold_s = nan"), &["hold_s = nan; expected a number"]),
        (&format!("{poke}hold_s = inf"), &["hold_s = inf; expected a number"]),
        (&format!("{poke}repeats = 2.5"), &["repeats = 2.5; expected a whole number from 1 to 10000"]),
        (&format!("{poke}repeats = 0"), &["repeats = 0; expected a whole number from 1"]),
        (&format!("{poke}hold_s = \"$hold_s\""), &["no such variable", "[variables] is empty"]),
        (
            &format!("{poke}direction = [0, 0, -2]"),
            &["direction = [0, 0, -2]; expected a unit vector", "this one's is 2.000"],
        ),
        (
            &format!("{poke}direction = [0, 0, -0.9]"),
            &["a unit vector", "length 1 to within 1 %; this one's is 0.900"],
        ),
        (&format!("{poke}direction = [0, -1]"), &["direction = [0, -1]; expected three numbers"]),
        (
            &format!("{poke}until_force_n = 1"),
            &["depth_mm = 3 stands beside until_force_n; expected only one"],
        ),
        (
            "kind = \"poke\"\nsite_mm = [1, 2, 3]\nspeed_mm_s = 2",
            &["depth_mm is missing; expected depth_mm, or until_force_n"],
        ),
        (
            "kind = \"poke\"\nsite_mm = [1, 2, 3]\nspeed_mm_s = 2\nuntil_force_n = 1",
            &["depth_limit_mm is missing; expected a number of mm"],
        ),
        (
            "kind = \"poke\"\nsite_mm = [1, 2, 3]\nspeed_mm_s = 2\ndepth_limit_mm = 1",
            &["depth_limit_mm = 1; expected until_force_n beside it"],
        ),
        (
            "kind = \"poke\"\nspeed_mm_s = 2\ndepth_mm = 1",
            &["p.toml:3:1: step 1 (poke): site_mm is missing; expected three numbers"],
        ),
        (
            "kind = \"poke\"\nsite_mm = [1, 2, 3]\ndepth_mm = 1",
            &["speed_mm_s is missing; expected a number of mm/s"],
        ),
        (
            "kind = \"air\"\nsite_mm = [1, 2, 3]\nspeed_mm_s = 2\nuntil_force_n = 1",
            &["step 1 (air): until_force_n = 1; there is no such key"],
        ),
        ("kind = \"wait\"\nwait_s = 1e9", &["wait_s = 1e9; expected a number of s from 0 to 86400"]),
        ("kind = \"ask\"\ntext = \" \"", &["text = \" \"; expected a text"]),
        ("kind = \"mark\"", &["step 1 (mark): text is missing"]),
        (
            "kind = \"cycles\"\nsite_mm = [1, 2, 3]\nspeed_mm_s = 2\noffset_mm = 1\namplitude_mm = 2\ncycles = 3",
            &["amplitude_mm = 2; expected at most offset_mm, which is 1"],
        ),
        (
            "kind = \"grid\"\norigin_mm = [1, 2, 3]\nspeed_mm_s = 2\ndepth_mm = 1\nspacing_mm = [1, 2]\ncounts = [3]",
            &["counts = [3]; expected one or two counts, as many as spacing_mm"],
        ),
        (
            "kind = \"grid\"\norigin_mm = [1, 2, 3]\nspeed_mm_s = 2\ndepth_mm = 1\nspacing_mm = [0]\ncounts = [3]",
            &["spacing_mm = [0]; expected a distance other than 0"],
        ),
        (
            "kind = \"grid\"\norigin_mm = [1, 2, 3]\nspeed_mm_s = 2\ndepth_mm = 1\nspacing_mm = [5]\ncounts = [3]\norder = \"snake\"",
            &["order = \"snake\"; expected one of \"rows\", \"columns\", \"serpentine\", \"random\""],
        ),
        (
            "kind = \"grid\"\norigin_mm = [1, 2, 3]\nspeed_mm_s = 2\ndepth_mm = 1\nfirst_mm = [5]\ncounts = [3]",
            &["first_mm = [5] stands beside counts"],
        ),
        (
            "kind = \"grid\"\norigin_mm = [1, 2, 3]\nspeed_mm_s = 2\ndepth_mm = 1\nfirst_mm = []",
            &["first_mm = []; expected a list"],
        ),
        (
            "kind = \"grid\"\norigin_mm = [1, 2, 3]\nspeed_mm_s = 2\ndepth_mm = 1\nfirst_mm = [5]\norder = \"random\"",
            &["seed is missing"],
        ),
    ];
    for (body, words) in cases {
        let refused = refusal(step(body));
        for word in *words {
            assert!(refused.contains(word), "{body}\n{refused}\nlacks {word}");
        }
        assert!(refused.starts_with("p.toml:"), "{refused}");
    }
    // What they slip from is sound.
    step(poke).expect("sound");
}

#[test]
fn the_file_as_a_whole_is_checked() {
    for (text, words) in [
        ("", "p.toml:1:1: protocol: format is missing; expected \"phantom-protocol/1\""),
        (
            "format = \"phantom-protocol/2\"\n",
            "format = \"phantom-protocol/2\"; expected \"phantom-protocol/1\"",
        ),
        ("format = \"phantom-protocol/1\"\n[[step]]\nkind = \"wait\"\nwait_s = 1", "name is missing"),
        ("format = \"phantom-protocol/1\"\nname = \"n\"\n[default]\nhold_s = 1", "did you mean defaults?"),
        (
            "format = \"phantom-protocol/1\"\nname = \"n\"\nstep = 3",
            "step = 3; expected at least one [[step]]",
        ),
        ("format = \"phantom-protocol/1\"\nname = \"n\"\n", "[[step]] is missing"),
        (
            "format = \"phantom-protocol/1\"\nname = \"n\"\nname = \"m\"",
            "p.toml:3:1: protocol: not TOML: duplicate key",
        ),
        ("format = ", "p.toml:1:10: protocol: not TOML"),
    ] {
        let refused = refusal(Protocol::parse("p.toml", text, &[]));
        assert!(refused.contains(words), "{refused}\nlacks {words}");
    }
}

#[test]
fn variables_and_defaults_are_checked() {
    let poke = "[[step]]\nkind = \"poke\"\nsite_mm = [50, 75, 25]\n";
    for (body, words) in [
        (
            format!("[variables]\nv_mm_s = 2\n{poke}speed_mm_s = 2\ndepth_mm = \"$v_mm_s\""),
            "depth_mm = \"$v_mm_s\", a variable in mm/s; expected one in mm",
        ),
        (
            format!("[variables]\nspeed_mm_s = 2\n{poke}speed_mm_s = \"$sped_mm_s\"\ndepth_mm = 1"),
            "no such variable; did you mean $speed_mm_s?",
        ),
        (
            format!("[variables]\ndeep_mm = \"3\"\n{poke}speed_mm_s = 2\ndepth_mm = 1"),
            "p.toml:4:11: [variables]: deep_mm = \"3\"; expected a number of mm",
        ),
        (
            format!("[defaults]\nsite_mm = [1, 2, 3]\n{poke}speed_mm_s = 2\ndepth_mm = 1"),
            "[defaults]: site_mm = [1, 2, 3]; there is no",
        ),
        (
            format!("[defaults]\nspeed_mm_s = 0\n{poke}depth_mm = 1"),
            "p.toml:4:14: [defaults]: speed_mm_s = 0; expected",
        ),
    ] {
        let refused = refusal(parse(&body));
        assert!(refused.contains(words), "{refused}\nlacks {words}");
    }
    // A bound without its force would say nothing beside the defaults' depth.
    let bound =
        refusal(parse(&format!("[defaults]\nspeed_mm_s = 1\ndepth_mm = 2\n{poke}depth_limit_mm = 3")));
    assert!(bound.contains("depth_limit_mm = 3 stands beside depth_mm"), "{bound}");
    // A step's own target goes before the defaults', and a whole number may come from a variable.
    let body = format!(
        "[variables]\nn = 3\n[defaults]\ndepth_mm = 2\nspeed_mm_s = 1_0.5\n{poke}until_force_n = 1\ndepth_limit_mm = 3\nrepeats = \"$n\""
    );
    let made = strokes(&parse(&body).expect("sound"));
    assert_eq!(made.len(), 3);
    let target = Target::Force { force_n: 1.0, depth_limit_m: 0.003 };
    assert_eq!(made[0].1.profile, Profile::Press { target, hold_s: 0.0 });
    assert_eq!(made[0].1.speed_m_s, 0.0105);
}

#[test]
fn all_steps_with_slips_are_told_at_once() {
    let body =
        "kind = \"wait\"\nwait_s = -1\n[[step]]\nkind = \"mark\"\n[[step]]\nkind = \"wait\"\nwait_s = 1\n";
    let AcquireError::Protocol { refusals } = step(body).expect_err("refused") else {
        panic!("of the protocol")
    };
    let lines: Vec<usize> = refusals.iter().map(|r| r.line).collect();
    assert_eq!(lines, [5, 6]);
}

#[test]
fn a_direction_that_is_nearly_of_length_one_is_made_so() {
    let made = strokes(
        &step("kind = \"poke\"\nsite_mm = [1, 2, 3]\nspeed_mm_s = 2\ndepth_mm = 1\ndirection = [0.5, 0, -0.866]").expect("sound"),
    );
    let direction = made[0].1.direction.expect("a direction");
    assert!((direction.iter().map(|c| c * c).sum::<f64>() - 1.0).abs() < 1e-15);
}

fn grid(order: &str) -> Vec<(u32, [f64; 3])> {
    let body = format!(
        "kind = \"grid\"\norigin_mm = [10, 20, 25]\nspeed_mm_s = 2\ndepth_mm = 1\nspacing_mm = [5, 2]\ncounts = [3, 2]\n{order}"
    );
    let place = |step: PlannedStep| match step.action {
        Action::Stroke { site_m, .. } => (step.id.place, site_m.map(|c| (c * 1e4).round() / 10.0)),
        _ => panic!("strokes only"),
    };
    step(&body).expect("sound").expand().into_iter().map(place).collect()
}

#[test]
fn a_grid_is_visited_in_its_order_and_places_keep_their_numbers() {
    let numbers = |order: &str| grid(order).iter().map(|(number, _)| *number).collect::<Vec<_>>();
    assert_eq!(numbers(""), [1, 2, 3, 4, 5, 6]);
    assert_eq!(numbers("order = \"columns\""), [1, 4, 2, 5, 3, 6]);
    assert_eq!(numbers("order = \"serpentine\""), [1, 2, 3, 6, 5, 4]);
    let places = grid("");
    assert_eq!(places[1].1, [15.0, 20.0, 25.0]);
    assert_eq!(places[5].1, [20.0, 22.0, 25.0]);
    let random = "order = \"random\"\nseed = 3";
    let mut shuffled = numbers(random);
    assert_eq!(shuffled, numbers(random));
    assert_ne!(shuffled, numbers("order = \"random\"\nseed = 4"));
    shuffled.sort_unstable();
    assert_eq!(shuffled, [1, 2, 3, 4, 5, 6]);
    for (number, place) in grid(random) {
        assert_eq!(places[number as usize - 1].1, place, "the same place has the same number");
    }
}

#[test]
fn absurd_counts_are_refused_before_anything_is_made() {
    let grid = |counts: &str, rest: &str| {
        format!(
            "kind = \"grid\"\norigin_mm = [1, 2, 3]\nspeed_mm_s = 2\ndepth_mm = 1\nspacing_mm = [1, 1]\ncounts = {counts}\n{rest}"
        )
    };
    let too_large = refusal(step(&grid("[100000, 10000]", "")));
    assert!(too_large.contains("counts = 100000; expected a whole number from 1 to 10000"), "{too_large}");
    let product = refusal(step(&grid("[10000, 10000]", "repeats = 10")));
    assert!(product.contains("1000000000 pokes and cycles up to here; expected 10000 at most"), "{product}");
    step(&grid("[100, 100]", "")).expect("just as many as are taken");
    let sum = refusal(step(&format!("{}[[step]]\n{}", grid("[100, 99]", ""), grid("[101, 1]", ""))));
    assert!(sum.contains("step 2 (grid): 10001 pokes"), "{sum}");
}

#[test]
fn a_session_goes_on_at_a_poke() {
    let steps = Protocol::parse("f", FIVE, &[]).expect("sound").expand();
    let rest = from_poke(&steps, 4).expect("there is one");
    assert_eq!((rest.len(), rest[0].poke, rest[0].id.to_string()), (2, Some(4), "6.1.1".to_owned()));
    let none = from_poke(&steps, 6).expect_err("five").to_string();
    assert_eq!(none, "there is no poke 6; the protocol's pokes are numbered from 1 to 5");
}

#[test]
fn a_list_of_pokes_is_a_protocol() {
    let poke = ListedPoke {
        site_m: [0.05, 0.075, 0.025],
        direction: [0.0, 0.0, -1.0],
        radius_m: 0.008,
        depth_m: 0.003,
        rate_m_s: 0.002,
        hold_s: 2.5,
    };
    let protocol = Protocol::of_pokes("next pokes", "continued", &[poke, poke], 2.0).expect("sound");
    let made = strokes(&protocol);
    assert_eq!((made.len(), made[1].0), (2, poke.site_m));
    assert_eq!((made[0].1.deepest_m(), made[0].1.radius_m, made[0].1.pause_s), (0.003, Some(0.008), 2.0));
    let wrong = ListedPoke { depth_m: 0.0, ..poke };
    let leaning = ListedPoke { direction: [0.0, 0.0, -2.0], ..poke };
    let refused = refusal(Protocol::of_pokes("next pokes", "n", &[poke, wrong, leaning], 2.0));
    assert!(
        refused.contains("next pokes:2:1: poke 2 of the list: depth_mm = 0; expected a number of mm"),
        "{refused}"
    );
    assert!(refused.contains("next pokes:3:1: poke 3 of the list: direction"), "{refused}");
    assert!(refusal(Protocol::of_pokes("next pokes", "n", &[], 2.0)).contains("at least one"));
    assert!(refusal(Protocol::of_pokes("p", "n", &vec![poke; 10_001], 2.0)).contains("10001 pokes"));
}
