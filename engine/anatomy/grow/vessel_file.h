#pragma once
/// Vessel trees written by people: a TOML file, and short texts for modifiers of a tree.

#include <cstdint>
#include <filesystem>
#include <string>

#include "engine/anatomy/grow/vessel_tree.h"

namespace io {
struct ParseContext;
class Section;
}  // namespace io

namespace anatomy {

/// A file has schema = 1 and either `preset`, with what is known of its patient (sex, age, height_cm,
/// weight_kg), or [[branch]] sections (name, parent, at_mm, points_mm = [[x, y, z, radius], …], a child's
/// relative to its start; closed, or joins and joins_at_mm), then any of [[target]] (name, branch, at_mm),
/// [[tortuosity]] (branch, amplitude_mm, wavelength_mm), [[stenosis]] (branch, at_mm, length_mm, percent,
/// eccentricity, angle_deg, calcified), [[aneurysm]] (branch, at_mm, diameter_mm, neck_mm, angle_deg),
/// [[fusiform_aneurysm]] (branch, at_mm, length_mm, diameter_mm), [[occlusion]] (branch, at_mm) and
/// [[dissection]] (branch, at_mm, length_mm, true_share, flap_mm, angle_deg). The spec is named after the
/// file. `seed` and `wish` apply to the preset; the file's own keys of the patient come before those wished.
/// Throws InputError listing every problem with its line.
VesselTreeSpec parse_vessel_file(const std::string& text, const std::filesystem::path& file,
                                 std::uint64_t seed = 0, const PatientWish& wish = {});
VesselTreeSpec load_vessel_file(const std::filesystem::path&, std::uint64_t seed = 0,
                                const PatientWish& wish = {});

/// The same as a section of another file, without schema: `preset` with `seed` and patient, or `tree`, a file
/// in the same folder, or [[branch]], and the modifiers. Problems are recorded in the reading. The spec is
/// named after preset or tree, else `name`.
VesselTreeSpec read_vessels(io::Section&, io::ParseContext&, const std::string& name);

/// BRANCH:AT:LENGTH:PERCENT, BRANCH:AT:DIAMETER:NECK[:ANGLE] and AMPLITUDE:WAVELENGTH[:BRANCH], in mm and
/// degrees. Throws InputError.
Stenosis parse_stenosis(const std::string&);
Aneurysm parse_aneurysm(const std::string&);
Tortuosity parse_tortuosity(const std::string&);

/// "f" or "m". Throws InputError.
Sex parse_sex(const std::string&);

}  // namespace anatomy
