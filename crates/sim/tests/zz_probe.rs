#![allow(missing_docs)]
use slate_sim::drive::Wheels; use slate_sim::geometry::Pose; use slate_sim::robot::RobotDescription; use slate_sim::world::{Body, World}; use slate_sim::{Placement, Simulation};
#[test] fn probe() {
    let description = RobotDescription::named("pioneer_p3dx").unwrap().unwrap();
    let hw = 0.165;
    let mut world = World::named("rocs_arena").unwrap().unwrap();
    world.bodies.push(Body::rectangle("post", [0.0, 0.5 + hw + 0.001 + 0.1], [0.2, 0.2]));
    let mut s = Simulation::new(&world, &[Placement{name:"r".into(), description, sonar:"vrep".into(), pose: Pose{x:-1.0,y:0.5,theta:0.0}, script:None}], 0, 10_000_000).unwrap();
    s.command(0, Wheels{left: 0.3/0.0975, right: 0.3/0.0975});
    for k in 0..600 { s.step(); let c = s.take_contacts(); if s.clearance(0) < 0.004 || !c.is_empty() { println!("{k} {:?} clearance {:.6} {} {:?}", s.pose(0), s.clearance(0), s.touches(0), c); } }
}
