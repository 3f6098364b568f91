//! Consistency check of an ELF file's headers.
//! The system's loader maps a file by its headers without a further check, and ends the process when they are wrong; so
//! redundant entries must agree.

use object::elf::{self, FileHeader64, ProgramHeader64, SectionHeader64};
use object::read::elf::{FileHeader, ProgramHeader, SectionHeader, SectionTable};
use object::{Endianness, ReadRef};

type Segment = ProgramHeader64<Endianness>;
type Section = SectionHeader64<Endianness>;

/// Checks the file's headers; the error describes the defect.
pub(super) fn check<'d>(header: &FileHeader64<Endianness>, bytes: impl ReadRef<'d>) -> Result<(), String> {
    let damaged = |error: object::Error| format!("is damaged: {error}");
    let endian = header.endian().map_err(damaged)?;
    let size = bytes.len().map_err(|()| "has no size")?;
    // Linkers put the headers of the sections last, so they are what a file that is cut off has lost.
    let length = u64::from(header.e_shnum(endian)) * u64::from(header.e_shentsize(endian));
    let end = header.e_shoff(endian).saturating_add(length);
    if end > size {
        return Err(format!("is cut off after {size} of {end} bytes, or damaged at its beginning"));
    }
    let segments = header.program_headers(endian, bytes).map_err(damaged)?;
    let sections = header.sections(endian, bytes).map_err(damaged)?;
    let view = LoadedHeaders { endian, segments };
    view.check_load_order()?;
    for (i, segment) in segments.iter().enumerate() {
        let checked = in_file(segment.file_range(endian), size).and_then(|()| view.check_segment(segment));
        checked.map_err(|problem| format!("is damaged: segment {i} {problem}"))?;
    }
    for (index, section) in sections.enumerate() {
        let checked = section.file_range(endian).map_or(Ok(()), |range| in_file(range, size));
        checked.and_then(|()| view.check_section(section)).map_err(|problem| {
            let name = sections.section_name(endian, section).unwrap_or_default();
            format!("is damaged: section {} `{}` {problem}", index.0, String::from_utf8_lossy(name))
        })?;
    }
    view.check_dynamic(&sections)?;
    view.check_read_only(&sections)
}

fn in_file((start, length): (u64, u64), size: u64) -> Result<(), &'static str> {
    let fits = start.checked_add(length).is_some_and(|end| end <= size);
    if fits { Ok(()) } else { Err("is not in the file") }
}

/// Smallest page of any machine.
const PAGE: u64 = 4096;

struct LoadedHeaders<'a> {
    endian: Endianness,
    segments: &'a [Segment],
}

impl LoadedHeaders<'_> {
    fn of_type(&self, kind: elf::ProgramType) -> impl Iterator<Item = &Segment> {
        self.segments.iter().filter(move |segment| segment.p_type(self.endian) == kind)
    }

    /// Returns a segment's range of memory, relative to the library's beginning.
    fn memory(&self, segment: &Segment) -> Option<(u64, u64)> {
        let start = segment.p_vaddr(self.endian);
        Some((start, start.checked_add(segment.p_memsz(self.endian))?))
    }

    /// Checks that loadable segments are ordered and lie in the file as in memory.
    /// Up to whole pages.
    fn check_load_order(&self) -> Result<(), String> {
        let mut last = 0;
        for segment in self.of_type(elf::PT_LOAD) {
            let align = segment.p_align(self.endian).max(1);
            let (offset, address) = (segment.p_offset(self.endian), segment.p_vaddr(self.endian));
            let range = self.memory(segment).filter(|(start, _)| *start >= last);
            let fits = align.is_power_of_two()
                && offset % align == address % align
                && segment.p_filesz(self.endian) <= segment.p_memsz(self.endian);
            match range.filter(|_| fits) {
                Some((_, end)) => last = end,
                None => return Err("is damaged: its segments do not fit together".into()),
            }
        }
        if last == 0 { Err("is damaged: it has no segment to load".into()) } else { Ok(()) }
    }

    /// Returns the mapped segment that contains that range of memory, and of the file.
    fn mapped(&self, address: u64, size: u64, offset: Option<u64>) -> Option<&Segment> {
        let end = address.checked_add(size)?;
        self.of_type(elf::PT_LOAD).find(|load| {
            let start = load.p_vaddr(self.endian);
            let length = match offset {
                Some(_) => load.p_filesz(self.endian),
                None => load.p_memsz(self.endian),
            };
            let same_place =
                |offset: u64| offset.checked_sub(load.p_offset(self.endian)) == address.checked_sub(start);
            start <= address && end <= start + length && offset.is_none_or(same_place)
        })
    }

    /// Checks that a segment which the loader reads is mapped.
    fn check_segment(&self, segment: &Segment) -> Result<(), &'static str> {
        let kind = segment.p_type(self.endian);
        if matches!(kind, elf::PT_LOAD | elf::PT_NULL | elf::PT_GNU_STACK) {
            return Ok(());
        }
        let (address, offset) = (segment.p_vaddr(self.endian), segment.p_offset(self.endian));
        let (in_file, in_memory) = (segment.p_filesz(self.endian), segment.p_memsz(self.endian));
        let is_whole = self.mapped(address, in_file, Some(offset)).is_some()
            // Thread-local data is copied, and its zeros are not in the file.
            && (kind == elf::PT_TLS || self.mapped(address, in_memory, None).is_some());
        if is_whole { Ok(()) } else { Err("is not in what is loaded") }
    }

    /// Checks that a section in use is mapped with suitable permissions.
    fn check_section(&self, section: &Section) -> Result<(), &'static str> {
        let flags = section.sh_flags(self.endian);
        let is_empty = section.sh_type(self.endian) == elf::SHT_NOBITS;
        if !flags.contains(elf::SHF_ALLOC) || (is_empty && flags.contains(elf::SHF_TLS)) {
            return Ok(());
        }
        let offset = (!is_empty).then(|| section.sh_offset(self.endian));
        let Some(load) = self.mapped(section.sh_addr(self.endian), section.sh_size(self.endian), offset)
        else {
            return Err("is not in what is loaded");
        };
        let allowed = load.p_flags(self.endian);
        let fits = allowed.contains(elf::PF_R)
            && (!flags.contains(elf::SHF_WRITE) || allowed.contains(elf::PF_W))
            && (!flags.contains(elf::SHF_EXECINSTR) || allowed.contains(elf::PF_X));
        if fits { Ok(()) } else { Err("is loaded so that it can't be used") }
    }

    /// Checks that the dynamic segment and section agree; the loader reads the segment.
    fn check_dynamic<'d, R: ReadRef<'d>>(
        &self,
        sections: &SectionTable<'d, FileHeader64<Endianness>, R>,
    ) -> Result<(), String> {
        let endian = self.endian;
        let mut dynamic_segments = self.of_type(elf::PT_DYNAMIC);
        let section = sections.iter().find(|section| section.sh_type(endian) == elf::SHT_DYNAMIC);
        let agree = dynamic_segments.next().zip(section).is_some_and(|(segment, section)| {
            segment.p_vaddr(endian) == section.sh_addr(endian)
                && segment.p_memsz(endian) == section.sh_size(endian)
        });
        let threads = |section: &Section| section.sh_flags(endian).contains(elf::SHF_TLS);
        let has_threads = self.of_type(elf::PT_TLS).count() == usize::from(sections.iter().any(threads));
        if agree && dynamic_segments.next().is_none() && has_threads {
            Ok(())
        } else {
            Err("is damaged: its segments and sections do not agree".into())
        }
    }

    /// Checks that no section is written that becomes read-only after loading (RELRO).
    fn check_read_only<'d, R: ReadRef<'d>>(
        &self,
        sections: &SectionTable<'d, FileHeader64<Endianness>, R>,
    ) -> Result<(), String> {
        let endian = self.endian;
        for segment in self.of_type(elf::PT_GNU_RELRO) {
            let Some((start, end)) = self.memory(segment) else { continue };
            let (start, end) = (start / PAGE * PAGE, end / PAGE * PAGE);
            let written = sections.iter().filter(|section| {
                let name = sections.section_name(endian, section).unwrap_or_default();
                matches!(name, b".data" | b".bss" | b".text" | b".plt")
            });
            let overlaps = |section: &Section| {
                let address = section.sh_addr(endian);
                address < end && start < address + section.sh_size(endian)
            };
            if written.into_iter().any(overlaps) {
                return Err("is damaged: what it writes to would be read-only".into());
            }
        }
        Ok(())
    }
}
