/// The importer against truth at full size: generated vessels, the same corrupted, and real meshes where they
/// are available: in the folder that SELDINGER_REAL_MESHES names.

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <gtest/gtest.h>
#include <regex>
#include <sstream>
#include <zlib.h>

#include "engine/anatomy/grow/generator.h"
#include "engine/anatomy/grow/vessel_presets.h"
#include "engine/anatomy/import/lumen_import.h"
#include "engine/anatomy/polydata.h"
#include "engine/io/error.h"
#include "engine/studies/anatomy_sign.h"
#include "tests/engine/anatomy/segmented.h"
#include "tests/engine/fixtures.h"

namespace {

namespace fs = std::filesystem;
using anatomy::ImportedLumen, studies::ImportErrors, anatomy::ImportOptions;
using geometry::Vec3;

ImportOptions millimetres() {
    ImportOptions options;
    options.unit = "mm";
    return options;
}

void expect_found(const anatomy::Anatomy& truth, const geometry::TriangleMesh& mesh, double radius_limit) {
    ImportOptions options = millimetres();
    for (const auto& end : truth.ends)
        if (end.role == anatomy::EndRole::Inlet) options.inlet = end.opening.centre;
    const ImportErrors errors =
        studies::import_errors(truth, anatomy::import_lumen(mesh, truth.name, options).anatomy);
    EXPECT_EQ(errors.branches, errors.true_branches) << truth.name;
    EXPECT_EQ(errors.invented, 0) << truth.name;
    EXPECT_EQ(errors.ends, errors.true_ends) << truth.name;
    EXPECT_LE(errors.centre_p95, 0.1) << truth.name;
    EXPECT_LE(errors.radius_p95, radius_limit) << truth.name;
}

fs::path real_meshes() {
    const char* named = std::getenv("SELDINGER_REAL_MESHES");
    return named ? fs::path(named) : fs::path("SELDINGER_REAL_MESHES-is-not-set");
}

std::string decoded(const std::string& text) {
    const std::string letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string bytes;
    unsigned held = 0;
    int bits = 0;
    for (const char c : text) {
        const auto value = letters.find(c);
        if (value == std::string::npos) break;
        held = held << 6 | static_cast<unsigned>(value);
        if ((bits += 6) >= 8) bytes += static_cast<char>(held >> (bits -= 8) & 0xff);
    }
    return bytes;
}

/// The points of a VTK poly-data file with appended, compressed arrays of single precision.
std::vector<Vec3> vtp_points(const fs::path& path) {
    std::stringstream stream;
    stream << std::ifstream(path, std::ios::binary).rdbuf();
    const std::string text = stream.str();
    std::smatch offset;
    std::regex_search(text, offset, std::regex("Name=\"Points\"[^>]*offset=\"([0-9]+)\""));
    const std::size_t start = text.find('_', text.find("<AppendedData")) + 1 + std::stoul(offset[1]);
    const auto word = [](const std::string& bytes, std::size_t i) {
        std::uint32_t value = 0;
        std::memcpy(&value, bytes.data() + 4 * i, 4);
        return value;
    };
    // A header of its own: blocks, their size, the last one's, then each one's once compressed.
    const std::uint32_t blocks = word(decoded(text.substr(start, 8)), 0);
    const std::size_t header = 4 * (3 + blocks), coded = (header + 2) / 3 * 4;
    const std::string sizes = decoded(text.substr(start, coded)),
                      packed = decoded(text.substr(start + coded, 1 << 20));
    std::string bytes;
    for (std::size_t b = 0, from = 0; b < blocks; from += word(sizes, 3 + b), ++b) {
        uLongf count = b + 1 == blocks && word(sizes, 2) > 0 ? word(sizes, 2) : word(sizes, 1);
        std::string block(count, '\0');
        if (uncompress(reinterpret_cast<Bytef*>(block.data()), &count,
                       reinterpret_cast<const Bytef*>(packed.data() + from), word(sizes, 3 + b)) != Z_OK)
            throw std::runtime_error("the centreline cannot be unpacked");
        bytes += block;
    }
    std::vector<Vec3> points(bytes.size() / 12);
    for (std::size_t i = 0; i < points.size(); ++i)
        for (std::size_t k = 0; k < 3; ++k) {
            float value = 0;
            std::memcpy(&value, bytes.data() + 12 * i + 4 * k, 4);
            points[i][static_cast<int>(k)] = value;
        }
    return points;
}

class RealMeshes : public testing::Test {
protected:
    void SetUp() override {
        if (!fs::exists(folder_ / "sofa_carotids.stl"))
            GTEST_SKIP() << "no real meshes in " << folder_
                         << ": set SELDINGER_REAL_MESHES to a folder that has them";
    }
    ImportedLumen imported(const char* name, const ImportOptions& options = millimetres()) const {
        return anatomy::import_lumen(folder_ / name, options);
    }
    fs::path folder_ = real_meshes();
};

}  // namespace

TEST(AnatomyImport, FindsEveryBranchOfGeneratedVesselsCleanAndCorrupted) {
    for (const char* preset : {"lca", "rca", "iliac-renal"}) {
        const anatomy::Anatomy truth = anatomy::generate(anatomy::vessel_preset(preset));
        expect_found(truth, truth.lumen, 0.1);
        expect_found(truth, studies::corrupted(truth.lumen, 1), 0.2);
    }
}

TEST(AnatomyImport, OpensAndPrunesTreesAsSegmentedFromCt) {
    int tips = 0;
    for (std::uint32_t seed = 100; seed < 106; ++seed) {
        const int wanted = 8 + static_cast<int>(seed * 7 % 30);
        const double voxel = 0.5 + 0.05 * static_cast<double>(seed % 5);
        const std::vector<test::Ball> tree = test::random_tree(seed, wanted, 0.3 * voxel);
        const geometry::TriangleMesh mesh = test::segmented(tree, voxel, static_cast<int>(seed % 4));
        const ImportedLumen lumen = anatomy::import_lumen(mesh, "segmented", millimetres());
        const anatomy::Anatomy& vessels = lumen.anatomy;
        EXPECT_TRUE(anatomy::problems(vessels).empty()) << "seed " << seed;
        EXPECT_GE(vessels.ends.size(), 2u) << "seed " << seed;
        // Wires come in by the trunk, which is closed as all else.
        EXPECT_LT((vessels.ends[0].opening.centre - tree[0].centre).norm(), 3 * tree[0].radius)
            << "seed " << seed;
        EXPECT_GT(vessels.ends[0].opening.radius, 0.7 * tree[0].radius) << "seed " << seed;
        tips += static_cast<int>(vessels.ends.size()) - 1;
    }
    EXPECT_GT(tips, 40);
}

TEST_F(RealMeshes, GeneratedOnesBesideThemAreFound) {
    for (const char* name : {"arch1", "arch3", "cerebral", "iliac", "lca"}) {
        const anatomy::Anatomy truth =
            anatomy::load_anatomy(folder_ / "generated" / (std::string(name) + ".anatomy.json"));
        expect_found(truth, truth.lumen, 0.1);
        expect_found(truth, studies::corrupted(truth.lumen, 3), 0.2);
    }
}

TEST_F(RealMeshes, CarotidsHaveThreeEnds) {
    const anatomy::Anatomy carotids = imported("sofa_carotids.stl").anatomy;
    EXPECT_EQ(carotids.ends.size(), 3u);
    EXPECT_EQ(carotids.branches.size(), 2u);
}

TEST_F(RealMeshes, PhantomHasEightEndsAndOneLoop) {
    ImportOptions options = millimetres();
    options.inlet = Vec3(0, 0, 0);
    const ImportedLumen phantom = imported("sofa_phantom.obj", options);
    EXPECT_EQ(phantom.anatomy.ends.size(), 8u);
    EXPECT_EQ(phantom.anatomy.branches.size(), 8u);  // to seven outlets, and one that closes the loop
    EXPECT_TRUE(std::any_of(phantom.findings.begin(), phantom.findings.end(),
                            [](const auto& f) { return f.text.starts_with("1 branch ends in another"); }));
}

TEST_F(RealMeshes, StenosisAgreesWithTheCentrelineBesideIt) {
    const anatomy::Anatomy stenosis = imported("carotid_stenosis_lumen.stl").anatomy;
    EXPECT_EQ(stenosis.ends.size(), 3u);
    EXPECT_EQ(stenosis.branches.size(), 2u);
    std::vector<double> distances;
    for (const Vec3& p : vtp_points(folder_ / "carotid_stenosis_lumen.centreline.vtp"))
        distances.push_back(studies::nearest_on(stenosis.branches, p).distance);
    ASSERT_EQ(distances.size(), 478u);
    EXPECT_EQ(anatomy::load_polydata(folder_ / "carotid_stenosis_lumen.centreline.vtp").points,
              vtp_points(folder_ / "carotid_stenosis_lumen.centreline.vtp"));
    std::sort(distances.begin(), distances.end());
    RecordProperty("p50_um", static_cast<int>(1000 * distances[distances.size() / 2]));
    RecordProperty("p95_um", static_cast<int>(1000 * distances[distances.size() * 95 / 100]));
    EXPECT_LE(distances[distances.size() * 95 / 100], 0.4);
}

TEST_F(RealMeshes, ThrombectomyMeshIsMendedAndLoads) {
    const ImportedLumen lumen = imported("steve_thrombectomy_remesh.obj");
    EXPECT_EQ(lumen.anatomy.ends.size(), 4u);
    EXPECT_TRUE(anatomy::problems(lumen.anatomy).empty());
}

TEST_F(RealMeshes, CoarseTreeIsRefusedAndLoadsWithItsCentrelines) {
    test::expect_refusal([&] { imported("steve_vessel_architecture_collision.obj"); }, "--centrelines");
    ImportOptions options = millimetres();
    options.centrelines = {folder_ / "steve_vessel_architecture.centrelines.json"};
    const ImportedLumen lumen = imported("steve_vessel_architecture_collision.obj", options);
    EXPECT_GE(lumen.anatomy.branches.size(), 5u);
    EXPECT_TRUE(anatomy::problems(lumen.anatomy).empty());
    EXPECT_TRUE(std::any_of(lumen.findings.begin(), lumen.findings.end(),
                            [](const auto& f) { return f.kind == anatomy::Finding::Kind::Warned; }));
}
