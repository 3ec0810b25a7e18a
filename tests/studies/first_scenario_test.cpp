/// The scenario that an import ends with, played as it is: in generated vessels and in real ones.

#include <cstdlib>
#include <gtest/gtest.h>

#include "engine/anatomy/anatomy_writer.h"
#include "engine/anatomy/grow/generator.h"
#include "engine/anatomy/grow/vessel_presets.h"
#include "engine/anatomy/import/import_run.h"
#include "engine/anatomy/import/lumen_import.h"
#include "engine/exercise/exercise.h"
#include "engine/exercise/handling.h"
#include "engine/io/error.h"
#include "engine/scenario/placement.h"
#include "tests/engine/fixtures.h"

namespace {

namespace fs = std::filesystem;

/// Twenty frames of it, the wire pushed on by a millimetre in each: nothing is refused and the tip stays in
/// the image.
void expect_played(const anatomy::Anatomy& imported) {
    SCOPED_TRACE(imported.name);
    const test::TemporaryFolder folder;
    const fs::path file = anatomy::write_anatomy(imported, folder.path(), {});
    const std::string toml = anatomy::first_scenario(imported, file);
    try {
        exercise::Exercise exercise(
            scenario::parse_scenario(toml, "first.toml", SELDINGER_SOURCE "/assets/devices"), false);
        for (int frame = 0; frame < 20; ++frame) {
            const std::vector<script::Command> commands = {script::Advance{1}};
            exercise.next_frame(commands);
            const exercise::Simulation& simulation = exercise.simulation();
            EXPECT_TRUE(exercise::in_open_field(simulation, simulation.tip())) << "frame " << frame << "\n"
                                                                               << toml;
        }
        EXPECT_GT(exercise.simulation().inserted(), 5) << toml;
    } catch (const io::InputError& error) {
        ADD_FAILURE() << error.what() << "\n" << toml;
    }
}

anatomy::Anatomy imported(const fs::path& mesh, const anatomy::ImportOptions& options) {
    return anatomy::import_lumen(mesh, options).anatomy;
}

}  // namespace

TEST(FirstScenario, WiresAreThoseOfTheCatalogue) {
    for (const anatomy::FirstWire& wire : anatomy::first_wires()) {
        const scenario::Device device = scenario::load_device(
            scenario::find_device(std::string(wire.name), SELDINGER_SOURCE "/assets/devices"));
        EXPECT_EQ(wire.diameter, device.outer_diameter) << wire.name;
        EXPECT_EQ(wire.least_inserted, physics::shaped_length(device) +
                                           physics::least_length({scenario::usual_segment_length(device)}))
            << wire.name;
    }
}

TEST(FirstScenario, OfGeneratedVesselsPlays) {
    anatomy::ImportOptions options;
    options.unit = "mm";
    for (const char* preset : {"lca", "rca", "iliac-renal"}) {
        const anatomy::Anatomy truth = anatomy::generate(anatomy::vessel_preset(preset));
        expect_played(truth);
        expect_played(anatomy::import_lumen(truth.lumen, preset, options).anatomy);
    }
}

TEST(FirstScenario, OfRealVesselsPlays) {
    const char* named = std::getenv("SELDINGER_REAL_MESHES");
    const fs::path folder = named ? named : "";
    if (!fs::exists(folder / "sofa_carotids.stl"))
        GTEST_SKIP() << "SELDINGER_REAL_MESHES names no folder of meshes";
    anatomy::ImportOptions options;
    options.unit = "mm";
    for (const char* name : {"sofa_carotids.stl", "sofa_phantom.obj", "carotid_stenosis_lumen.stl",
                             "steve_thrombectomy_remesh.obj", "generated/arch1.stl", "generated/arch3.stl",
                             "generated/cerebral.stl", "generated/iliac.stl", "generated/lca.stl"})
        expect_played(imported(folder / name, options));
    options.centrelines = {folder / "steve_vessel_architecture.centrelines.json"};
    expect_played(imported(folder / "steve_vessel_architecture_collision.obj", options));
}
