//! Tests of padding: the bytes that a typed write leaves in it are zeroed.
//! They are zeroed before the bytes are read.

use std::cell::Cell;

use slate_blackboard::Stamp;
use slate_blackboard::interface::{CanonicalForm, View};

use super::{Output, Port, PortCursor};
use crate::{Bool, Direction, Frame, Interface, PortSlot, Random, Sequence, interface};

/// With padding between its fields and behind them.
#[interface]
#[derive(PartialEq)]
pub struct Gapped {
    /// Before 7 bytes of padding.
    pub small: u8,
    /// Not beside padding.
    pub big: f64,
    /// Before 7 bytes of padding.
    pub flag: Bool,
}

/// With padding inside of a sequence.
#[interface]
#[derive(PartialEq)]
pub struct Many {
    /// Each with padding.
    pub list: Sequence<Gapped, 2>,
    /// Before 6 bytes of padding.
    pub end: u16,
}

/// With padding before its tail, and inside of the items.
#[interface]
pub struct Tailed {
    /// Before 7 bytes of padding.
    pub head: u8,
    /// Each with padding.
    pub items: [Gapped],
}

const GAPPED: Gapped = Gapped { small: 1, big: 2.5, flag: Bool::TRUE };

/// Returns the bytes of [`GAPPED`].
fn expected() -> Vec<u8> {
    let mut bytes = vec![0; 24];
    bytes[0] = 1;
    bytes[8..16].copy_from_slice(&2.5_f64.to_ne_bytes());
    bytes[16] = 1;
    bytes
}

/// Writes by an output over memory that is full of other bytes, and commits.
fn committed<T: Interface + ?Sized>(items: usize, write: impl FnOnce(&Output<T>)) -> Vec<u8> {
    let mut memory = [0xAAAA_AAAA_AAAA_AAAA_AAAA_AAAA_AAAA_AAAA_u128; 8];
    let data = memory.as_mut_ptr().cast::<u8>();
    let slot = PortSlot {
        schema: T::DESCRIPTOR.hash,
        data,
        items: Cell::new(0),
        capacity: items,
        stamp: Stamp::default(),
        flags: Cell::new(0),
        direction: Direction::Output as u32,
        priority: Cell::new(0),
        entries: std::ptr::null(),
        count: Cell::new(0),
        missed: 0,
    };
    let random = Cell::new(Random::new(0, ""));
    let frame = Frame {
        ports: &raw const slot,
        port_count: 1,
        params: std::ptr::null(),
        params_size: 0,
        params_version: 0,
        now: 0,
        elapsed: 0,
        number: 1,
        random: &raw const random,
        host: std::ptr::null(),
    };
    // SAFETY: the slot has room for the value, and outlives the port.
    write(&unsafe { Output::<T>::bind(&mut PortCursor::new(&frame)) });
    let length = T::DESCRIPTOR.shape(items).bytes(items);
    // SAFETY: the memory holds the value that was written.
    unsafe { CanonicalForm::new(T::DESCRIPTOR).canonical(data, length, items) }.to_vec()
}

#[test]
fn padding_is_zero_after_a_typed_write() {
    assert_eq!(committed::<Gapped>(0, |output| output.set(GAPPED)), expected());
}

#[test]
fn padding_of_sequence_items_is_zero() {
    let bytes = committed::<Many>(0, |output| {
        output.set(Many { list: Sequence::new(&[GAPPED, GAPPED]), end: 3 });
    });
    assert_eq!(bytes.len(), 8 + 2 * 24 + 8);
    assert_eq!(bytes[8..32], expected());
    assert_eq!(bytes[32..56], expected());
    assert_eq!(bytes[58..], [0; 6]);
}

#[test]
fn padding_of_a_tail_is_zero() {
    let bytes = committed::<Tailed>(2, |output| {
        assert!(output.write(2, |value| {
            value.head = 7;
            value.items.fill(GAPPED);
        }));
    });
    assert_eq!(bytes[..8], [7, 0, 0, 0, 0, 0, 0, 0]);
    assert_eq!(bytes[8..32], expected());
    assert_eq!(bytes[32..], expected());
}

#[test]
fn view_of_a_value_has_no_padding() {
    let mut value = GAPPED;
    assert_eq!(View::of(&mut value).bytes(), expected());
    assert_eq!(value, GAPPED);
}

#[test]
fn padding_is_no_field() {
    let names: Vec<_> = Tailed::DESCRIPTOR.fields.iter().map(|field| (field.name, field.offset)).collect();
    assert_eq!(names, [("head", 0), ("items", 8)]);
    assert_eq!(Tailed::DESCRIPTOR.size, 8);
    let mut memory = [0_u64; 4];
    // SAFETY: the memory has room for one item.
    let value = unsafe { Tailed::from_raw_mut(memory.as_mut_ptr().cast(), 1) };
    assert_eq!(std::ptr::from_ref(&value.items[0]).addr() - std::ptr::from_ref(&value.head).addr(), 8);
    assert_eq!(
        format!("{value:?}"),
        "Tailed { head: 0, items: [Gapped { small: 0, big: 0.0, flag: false }] }"
    );
}
