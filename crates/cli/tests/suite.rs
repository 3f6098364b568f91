//! All tests of the crate that share a process, in one program: each program costs link time.

mod absent_kinds;
#[path = "bag/main.rs"]
mod bag;
mod batch;
#[cfg(feature = "external-tools")]
mod browser;
mod command;
mod common;
mod console;
mod dds;
mod deployment;
mod display;
mod evaluate;
mod gates;
mod groot;
mod interface;
mod interface_import;
mod isolation;
mod localization;
mod logs;
mod loose;
mod mapping;
#[cfg(feature = "mcp")]
mod mcp;
mod mission;
mod network;
mod new;
mod operate;
mod over_http;
mod page;
mod plugin_new;
mod reach;
mod recompute;
mod record;
mod record_faults;
mod record_live;
mod record_variants;
mod refusals;
mod remote;
mod replay;
mod report;
mod rescue;
mod ros1;
mod ros2;
mod sharing;
mod snapshot;
mod stop;
mod strategies;
mod surface;
mod switches;
mod team;
mod trace;
mod tutorial;
mod values;
