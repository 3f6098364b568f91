//! Text of theories and programs.

mod expressions;
mod lexer;
mod parser;
mod programs;
mod written;

pub(crate) use parser::parse;
pub(crate) use written::*;
