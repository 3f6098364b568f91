//! The evaluation of the localization, in its smallest form.

use slate_evaluation::{Figure, localization};

#[test]
fn a_pose_in_the_office_is_found_and_followed() {
    let evaluations = localization::evaluate(None, 2).unwrap();
    let [office] = &evaluations[..] else { unreachable!("the office is the only building") };
    let missed: Vec<&str> = office
        .figures
        .iter()
        .filter(|figure| !figure.is_reached())
        .map(|figure| figure.name.as_str())
        .collect();
    assert!(missed.is_empty(), "{missed:?}");
    let goals = office.figures.iter().filter(|figure| figure.goal.is_some());
    assert_eq!(goals.map(Figure::is_reached).count(), 4);
    // Laser and noise are named.
    assert!(office.notes[0].starts_with("laser utm_30lx"));
}

#[test]
fn without_a_start_no_goal_is_reached() {
    let evaluations = localization::evaluate(None, 0).unwrap();
    let mut goals =
        evaluations.iter().flat_map(|office| &office.figures).filter(|figure| figure.goal.is_some());
    assert!(goals.all(|figure| figure.value.is_nan() && !figure.is_reached()));
}

#[test]
fn a_folder_without_the_map_is_refused() {
    let error = localization::evaluate(Some("nowhere".as_ref()), 1).unwrap_err();
    assert!(error.to_string().starts_with("nowhere/maps/hospital_section.png: "), "{error}");
}
