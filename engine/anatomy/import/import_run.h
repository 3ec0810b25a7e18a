#pragma once
/// Imports one anatomy, from a mesh file to the files in a folder, with a scenario to begin with.

#include <filesystem>
#include <span>
#include <string>
#include <string_view>

#include "engine/anatomy/anatomy.h"
#include "engine/anatomy/import/lumen_import.h"
#include "engine/anatomy/import/mask_import.h"
#include "render/xray/c_arm.h"

namespace anatomy {

/// A wire of the catalogue, which this room can't read; FirstScenario.WiresAreThoseOfTheCatalogue compares.
struct FirstWire {
    std::string_view name;
    double diameter, least_inserted;  // its shape and two segments [mm]
};
/// Widest first.
std::span<const FirstWire> first_wires();

/// TOML that `seldinger run` and `render` take as it is: a wire that passes as far as the target, so much of
/// it inside that its tip is well within the vessels, and the tip in view. `file` is the anatomy's, as the
/// scenario names it.
/// With a CT, as the scenario names it, that is the patient.
/// With a view, that is the C-arm's; of that only the pose counts.
std::string first_scenario(const Anatomy&, const std::filesystem::path& file,
                           const std::filesystem::path& ct = {}, const std::string& series = {},
                           const std::optional<render::CArm>& view = {});

/// The pose of the C-arm that two or three points of 3D Slicer (.mrk.json) state, in their order: the focal
/// spot, the isocentre (left out, as far from the focal spot as by default) and the middle of the detector.
/// Throws InputError for points that no C-arm has.
render::CArm load_view(const std::filesystem::path&);

struct ImportRequest {
    std::filesystem::path mesh, out;  // a surface; or none, and the vessel is that of `mask`
    std::string name;                 // of the files; by default the mesh's or the mask's
    MaskSource mask;                  // its CT is the patient of the scenario, with a mesh too
    ImportOptions options;
    std::string body;  // part of the body, as place_in_part() takes it; empty = not said
    std::optional<geometry::Vec3> landmark;  // of the body [mm]
    std::filesystem::path view;  // points as load_view reads them, for the scenario; empty = from the front
    std::filesystem::path scenario;  // file for the scenario that the report ends with; empty = none, with a
                                     // CT OUT/NAME.toml
    std::string program;             // name and version, for the provenance
};

struct ImportOutcome {
    std::filesystem::path file;  // NAME.anatomy.json
    std::string report;          // what was found and repaired, checks, and a scenario to begin with
};

/// Throws InputError, before any work when the folder cannot be written; it is then left unchanged.
ImportOutcome run_import(const ImportRequest&);

/// The checks of an anatomy file, a line each. `fine` is true when none failed. Throws InputError for a file
/// that cannot be loaded.
struct CheckOutcome {
    std::string report;
    bool fine = true;
};
CheckOutcome run_check(const std::filesystem::path& anatomy);

}  // namespace anatomy
