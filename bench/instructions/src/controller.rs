//! Tick of one controller in Rust and in C++, by the calls that a host makes.
#![allow(unsafe_code, reason = "it is the host of modules behind the C interface")]

use std::cell::Cell;
use std::hint::black_box;

use slate_module::prelude::*;
use slate_module::table::{Bytes, DONE, SetupTable, Sink};
use slate_module::{Direction, Flags, Frame, Host, ModuleTable, PluginTable, PortSlot, Random, Stamp};

/// Position and heading.
#[interface]
pub struct Pose {
    #[unit("m")]
    pub x: f64,
    #[unit("m")]
    pub y: f64,
    #[unit("rad")]
    pub theta: f64,
}

/// Velocity.
#[interface]
pub struct Twist {
    #[unit("m/s")]
    pub linear: f64,
    #[unit("rad/s")]
    pub angular: f64,
}

#[ports]
pub struct ControllerIo {
    #[stale(after = "200ms")]
    pose: Required<Pose>,
    target: Required<Pose>,
    #[stale(after = "200ms")]
    feedforward: Input<Twist>,
    twist: Output<Twist>,
}

#[params]
pub struct ControllerParams {
    #[param(default = 0.8, doc = "proportional gain")]
    gain: f64,
    #[param(default = 0.1, doc = "integral gain")]
    integral_gain: f64,
    #[param(default = 1.0, doc = "maximum linear velocity")]
    max_linear_velocity: f64,
}

/// Proportional-integral control of a pose.
pub struct Controller;

#[module(stage = Act)]
impl Module for Controller {
    type Io = ControllerIo;
    type Params = ControllerParams;
    /// Integral of the error, and steps.
    type State = (f64, u64);

    fn tick(state: &mut (f64, u64), io: &ControllerIo, params: &ControllerParams, now: &Tick) -> Outcome {
        let Some(pose) = io.pose.fresh() else { return Outcome::Degraded };
        let error = io.target.x - pose.x;
        state.0 += error * now.elapsed();
        state.1 += 1;
        let base = io.feedforward.fresh().map_or(0.0, |feedforward| feedforward.linear);
        let linear = base + params.gain * error + params.integral_gain * state.0;
        let most = params.max_linear_velocity;
        io.twist.set(Twist {
            linear: if linear > most { most } else { linear },
            angular: params.gain * (io.target.theta - pose.theta),
        });
        Outcome::Ok
    }
}

unsafe extern "C" {
    /// From `controller.cpp`.
    static slate_plugin_controller: PluginTable;
}

/// Makes steps of the controller in Rust or in C++.
pub fn ticks(count: u32, is_cpp: bool) -> Result<(), String> {
    let table = if is_cpp {
        // SAFETY: the table of the linked object is constant, and has one module.
        unsafe { *slate_plugin_controller.modules }
    } else {
        ModuleTable::of::<Controller>()
    };
    let params = ControllerParams { gain: 0.8, integral_gain: 0.1, max_linear_velocity: 1.0 };
    let params_bytes = Bytes { data: (&raw const params).cast(), length: size_of::<ControllerParams>() };
    let setup = SetupTable {
        name: Bytes::of("controller"),
        seed: 0,
        period: 20_000_000,
        section: Bytes::NONE,
        params: Bytes::NONE,
    };
    let sink = Sink { context: std::ptr::null_mut(), write: ignore };
    let mut instance = std::ptr::null_mut();
    // SAFETY: all of it lives during the call.
    if unsafe { (table.create)(&raw const setup, params_bytes, &raw mut instance, &raw const sink) } != DONE {
        return Err("the controller can't be made".into());
    }
    let (mut pose, mut target) = (Pose::default(), Pose { x: 1.0, y: 0.0, theta: 1.0 });
    let (mut feedforward, mut twist) = (Twist::default(), Twist::default());
    let ports = [
        slot(&mut pose, Pose::DESCRIPTOR.hash, Direction::Input),
        slot(&mut target, Pose::DESCRIPTOR.hash, Direction::Input),
        slot(&mut feedforward, Twist::DESCRIPTOR.hash, Direction::Input),
        slot(&mut twist, Twist::DESCRIPTOR.hash, Direction::Output),
    ];
    let random = Cell::new(Random::new(0, "controller"));
    let host = Host { context: std::ptr::null(), log: drop_message };
    let mut frame = Frame {
        ports: ports.as_ptr(),
        port_count: ports.len(),
        params: params_bytes.data,
        params_size: params_bytes.length,
        params_version: 1,
        now: 0,
        elapsed: 20_000_000,
        number: 0,
        random: &raw const random,
        host: &raw const host,
    };
    for _ in 0..count {
        frame.number += 1;
        // SAFETY: `create` has made the instance, and the frame has what the description says.
        let outcome = unsafe { (black_box(table.tick))(instance, black_box(&raw const frame)) };
        if outcome != Outcome::Ok as i32 {
            return Err(format!("a tick ends with {outcome}"));
        }
    }
    let is_set = ports[3].flags.get() & Flags::SET != 0;
    // SAFETY: `create` has made the instance.
    unsafe { (table.destroy)(instance, &raw const sink) };
    if is_set { Ok(()) } else { Err("the output was not written".into()) }
}

fn slot<T>(value: &mut T, schema: u64, direction: Direction) -> PortSlot {
    PortSlot {
        schema,
        data: (&raw mut *value).cast(),
        items: Cell::new(0),
        capacity: 0,
        stamp: Stamp { sequence: 1, time: 0, generation: 1 },
        flags: Cell::new(Flags::NEW | Flags::ALIVE),
        direction: direction as u32,
        priority: Cell::new(0),
        entries: std::ptr::null(),
        count: Cell::new(0),
        missed: 0,
    }
}

unsafe extern "C" fn ignore(_: *mut (), _: *const u8, _: usize) {}

unsafe extern "C" fn drop_message(_: *const (), _: u32, _: *const u8, _: usize) {}
