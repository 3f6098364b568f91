//! Interfaces of the tests, as `target.idl` has them.

use std::path::Path;
use std::sync::Arc;

use serde_json::{Value as Json, json};
use slate_blackboard::interface::{Interface, shape_of};
use slate_dds::{IdlFile, IdlMessage, IdlStruct, Representation};
use slate_module::prelude::*;

/// A point in the plane.
#[interface]
#[derive(PartialEq)]
pub struct Point {
    pub x: f64,
    pub y: f64,
}

/// Something to drive to.
#[interface]
#[derive(PartialEq)]
pub struct Target {
    pub position: Point,
    pub corner: [f64; 2],
    pub path: Sequence<Point, 4>,
    pub weights: Sequence<f32, 8>,
    pub id: i64,
    pub name: Text<16>,
    pub mode: u8,
    pub valid: Bool,
    pub reserved: [u8; 2],
}

/// Bytes.
#[interface]
pub struct Blob {
    pub width: u32,
    pub data: [u8],
}

/// A number.
#[interface]
#[derive(PartialEq)]
pub struct Count {
    pub value: f64,
}

/// The target of a number, whose fields all differ.
pub fn target(number: u8) -> Json {
    let value = f64::from(number);
    let path = &[json!({ "x": 1.0, "y": value }), json!({ "x": 2.0, "y": value })][..usize::from(number % 3)];
    let weights = &[0.5, value, 2.5][..usize::from(number % 4)];
    let mode = [0, 1, 7][usize::from(number % 3)];
    json!({
        "position": { "x": value, "y": -value / 4.0 },
        "corner": [value + 0.5, value - 0.5],
        "path": path,
        "weights": weights,
        "id": -i64::from(number),
        "name": format!("target {number}"),
        "mode": mode,
        "valid": number.is_multiple_of(2),
    })
}

/// A value as it lies in memory.
pub fn bytes_of<T: Interface + ?Sized>(value: &Json) -> Vec<u8> {
    slate_topics::bytes(T::DESCRIPTOR, shape_of::<T>(2000), value).unwrap()
}

/// A struct of `target.idl`.
pub fn structure(name: &str) -> Arc<IdlStruct> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/dds/target.idl");
    IdlFile::read(&path).unwrap().structure(name).unwrap()
}

/// Targets as messages of a struct of `target.idl`.
pub fn message(name: &str, representation: Representation) -> IdlMessage {
    IdlMessage::of(Target::DESCRIPTOR, &structure(name), representation).unwrap()
}
