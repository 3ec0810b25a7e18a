#include "engine/exercise/transport.h"

#include <algorithm>
#include <cstring>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <numbers>
#include <random>

#include "engine/anatomy/lumen_wall.h"
#include "engine/anatomy/scenes.h"
#include "engine/exercise/body.h"
#include "engine/exercise/packed_body.h"
#include "engine/io/error.h"
#include "engine/io/files.h"
#include "physics/geometry/checksum.h"
#include "physics/geometry/mesh_topology.h"
#include "physics/geometry/packed_mesh.h"
#include "render/patient/patient.h"
#include "tests/engine/exercise/with_body.h"
#include "tests/engine/fixtures.h"

namespace exercise {
namespace {

std::span<const std::byte> bytes_in(const std::string& text) {
    return std::as_bytes(std::span(text));
}

/// Two closed meshes, one with a hole through it whose corners are elsewhere in the list, and texture.
Body small_body(unsigned seed) {
    std::mt19937 random(seed);
    const auto part = [&] { return random() * 0x1p-32; };
    Body body;
    body.origin = {0.1, -2.0 / 3, 1e-9};
    for (int l = 0; l < 2; ++l) {
        render::TissueLayer& layer = body.layers.emplace_back();
        layer.name = l == 0 ? "torus" : "";
        layer.material = render::Material::SoftTissue;
        layer.closed = true;
        const int around = 40, across = 12 + l;
        for (int i = 0; i < around; ++i)
            for (int j = 0; j < across; ++j) {
                const double u = 2 * std::numbers::pi * i / around, v = 2 * std::numbers::pi * j / across;
                layer.mesh.vertices.emplace_back((60 + 20 * std::cos(v)) * std::cos(u),
                                                 (60 + 20 * std::cos(v)) * std::sin(u),
                                                 20 * std::sin(v) + part());
            }
        const auto at = [&](int i, int j) { return i % around * across + j % across; };
        for (int i = 0; i < around; ++i)
            for (int j = 0; j < across; ++j) {
                layer.mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
                layer.mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
            }
        std::ranges::shuffle(layer.mesh.triangles, random);
        for (int b = 0; b < 300; ++b) {
            render::TextureBlob blob;
            blob.middle = Eigen::Vector3d(part() * 100, part() * 100 - 50, part() * 700).cast<float>();
            blob.axis = Eigen::Vector3d(part() - 0.5, part() - 0.5, part() - 0.5).normalized().cast<float>();
            blob.radius = static_cast<float>(0.5 + 2 * part());
            blob.elongation = static_cast<float>(std::exp(4 * part() - 1));
            blob.fraction = static_cast<float>(2 * part() - 1);
            layer.texture_blobs.push_back(blob);
        }
    }
    return body;
}

/// With texture of patterns, too.
Body small_rounded_body(unsigned seed) {
    Body body = small_body(seed);
    render::TexturePattern tissue, grain, plaques;
    tissue.seed = seed;
    tissue.numbers = {-80, -80, -30, 160, 160, 60, 0.1, -2, 0.5};
    const auto in_torus = [](const geometry::Vec3& p) {
        return 20 - std::hypot(std::hypot(p.x(), p.y()) - 60, p.z());
    };
    tissue.choose({}, [&](const render::TextureTry& at) { return in_torus(at.middle) > at.radius; });
    const geometry::TriangleMesh mesh = geometry::ordered(body.layers[0].mesh);
    grain.kind = render::TexturePattern::Kind::Grain;
    grain.numbers = {0.1, 12, 4, 0, 0.3, 0.5, 2};
    grain.from = 10;
    grain.to = mesh.triangles.size();
    grain.choose(mesh, [&](const render::TextureTry& at) { return in_torus(at.middle) > 2; });
    plaques.kind = render::TexturePattern::Kind::Plaques;
    plaques.numbers[0] = 0.5;
    plaques.to = mesh.triangles.size() / 2;
    body.textures = {{300, {tissue, grain, plaques}}, {300, {}}};
    return rounded_body(body);
}

double volume(const geometry::TriangleMesh& mesh) {
    double sum = 0;
    for (const auto& t : mesh.triangles)
        sum += mesh.vertices[t[0]].dot(mesh.vertices[t[1]].cross(mesh.vertices[t[2]])) / 6;
    return sum;
}

using Corners = std::array<std::array<long, 3>, 3>;
/// Triangles as places of corners, the least first, in order.
std::vector<Corners> shape(const geometry::TriangleMesh& mesh) {
    std::vector<Corners> all;
    for (const auto& t : mesh.triangles) {
        Corners corners;
        for (std::size_t k = 0; k < 3; ++k)
            for (int d = 0; d < 3; ++d)
                corners[k][static_cast<std::size_t>(d)] =
                    std::lround(std::floor(mesh.vertices[t[k]][d] / render::corner_step + 0.5));
        std::ranges::rotate(corners, std::ranges::min_element(corners));
        all.push_back(corners);
    }
    std::ranges::sort(all);
    return all;
}

const anatomy::Anatomy& small_tube() {
    static const anatomy::Anatomy tube =
        anatomy::tube_anatomy("tube", {{0, 0, 0}, {5, 0, 0}, {10, 1, 0}}, 1.5);
    return tube;
}

struct Packed {
    std::vector<CarriedFile> files;
    std::string bytes;
};
/// Of vessels with a coarse field.
const Packed& small_exercise() {
    static const Packed packed = [] {
        const test::TemporaryFolder folder;
        anatomy::ModelCache cache;
        cache.folder = folder / "cache";
        static_cast<void>(anatomy::cached_distance_field(small_tube(), 1.0, 0.3, cache));
        Packed all;
        for (const anatomy::CacheItem& item : anatomy::cache_items(cache.folder))
            all.files.push_back(
                {item.path.filename().string(), io::read_text(item.path, "file", "expected one")});
        all.files.push_back({"anatomy-0123456789abcdef.bin", "vessels as they are"});
        all.files.push_back({"body-00000000000000ff.bin", bytes_of(small_rounded_body(1), 255)});
        all.bytes = packed_for_transport(all.files, small_tube());
        return all;
    }();
    return packed;
}

/// With checksums that are right again, so that what reads the rest is reached.
void seal(std::string& bytes) {
    const std::size_t head = 32;
    if (bytes.size() < head) return;
    std::size_t at = head;
    for (int e = 0; e < 3 && at + 80 <= bytes.size(); ++e) {
        std::uint64_t size = 0;
        std::memcpy(&size, bytes.data() + at + 48, sizeof size);
        if (size > bytes.size() - at - 80) break;
        const std::uint64_t sum = geometry::checksum(bytes_in(bytes).subspan(at + 80, size));
        std::memcpy(bytes.data() + at + 64, &sum, sizeof sum);
        at += 80 + size;
    }
    const std::uint64_t sum = geometry::checksum(bytes_in(bytes).subspan(head));
    std::memcpy(bytes.data() + 24, &sum, sizeof sum);
}

}  // namespace

TEST(PackedBody, KeepsMeshesAndTextureWithinItsSteps) {
    for (unsigned seed = 1; seed <= 20; ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        const Body body = small_body(seed);
        const std::string packed = packed_body(body);
        const Body back = unpacked_body(bytes_in(packed), std::size_t{1} << 24);
        EXPECT_EQ(back.origin, body.origin);
        ASSERT_EQ(back.layers.size(), body.layers.size());
        for (std::size_t l = 0; l < body.layers.size(); ++l) {
            const render::TissueLayer &a = body.layers[l], &b = back.layers[l];
            EXPECT_EQ(b.name, a.name);
            EXPECT_EQ(b.material, a.material);
            EXPECT_EQ(b.mesh.vertices.size(), a.mesh.vertices.size());
            EXPECT_EQ(shape(b.mesh), shape(a.mesh));
            EXPECT_NEAR(volume(b.mesh), volume(a.mesh), 1e-3 * volume(a.mesh));
            ASSERT_EQ(b.texture_blobs.size(), a.texture_blobs.size());
            for (const render::TextureBlob& blob : a.texture_blobs) {
                const auto nearest =
                    std::ranges::min_element(b.texture_blobs, {}, [&](const render::TextureBlob& other) {
                        return (other.middle - blob.middle).squaredNorm();
                    });
                EXPECT_LT((nearest->middle - blob.middle).cwiseAbs().maxCoeff(), 0.14);
                EXPECT_NEAR(nearest->radius / blob.radius, 1, 0.031);
                EXPECT_NEAR(nearest->elongation / blob.elongation, 1, 0.031);
                EXPECT_NEAR(nearest->fraction, blob.fraction, 1.001 / 128);
                const double turned = std::acos(std::min(1.0f, std::abs(nearest->axis.dot(blob.axis))));
                EXPECT_LT(turned, blob.elongation > 4.1                        ? 0.06
                                  : std::abs(std::log(blob.elongation)) > 0.13 ? 0.2
                                                                               : 0.8);
            }
        }
    }
}

TEST(PackedBody, RoundedOnceItComesBackToTheBit) {
    for (unsigned seed = 1; seed <= 20; ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        const Body once = small_rounded_body(seed);
        EXPECT_TRUE(bytes_of(rounded_body(once), 1) == bytes_of(once, 1));
    }
}

TEST(PackedBody, ABodyOfAnExerciseComesBackToTheBitWithinTheLengthThatItStates) {
    const anatomy::Anatomy vessels = scenario::anatomy_of(test::small_scenario_with_patient(), {});
    const auto body = body_around(vessels);
    std::size_t singles = 0, all = 0;
    for (std::size_t l = 0; l < body->layers.size(); ++l) {
        singles += body->textures[l].singles;
        all += body->layers[l].texture_blobs.size();
        EXPECT_EQ(topology(body->layers[l].mesh).boundary_edges, 0) << body->layers[l].name;
        for (const geometry::Vec3& v : body->layers[l].mesh.vertices)
            ASSERT_EQ(geometry::on_grid(v, render::corner_step), v);
    }
    EXPECT_GT(all, 3 * singles);  // patterns draw most
    const std::uint64_t key = body_key(vessels);
    const std::string kept = bytes_of(*body, key), packed = packed_body(*body);
    EXPECT_LT(packed.size(), kept.size() / 20);
    // The reader's limit is the length that the file states; less is refused.
    EXPECT_TRUE(bytes_of(unpacked_body(bytes_in(packed), kept.size()), key) == kept);
    EXPECT_THROW(static_cast<void>(unpacked_body(bytes_in(packed), kept.size() * 9 / 10)),
                 std::runtime_error);
    const std::vector<CarriedFile> files{{"body-" + fmt::format("{:016x}", key) + ".bin", kept}};
    const std::string carried = packed_for_transport(files, vessels);
    EXPECT_TRUE(unpacked_from_transport(bytes_in(carried)).at(0).bytes == kept);
}

TEST(Transport, BringsFilesByteForByte) {
    const auto& [files, bytes] = small_exercise();
    const std::vector<CarriedFile> back = unpacked_from_transport(bytes_in(bytes));
    ASSERT_EQ(back.size(), files.size());
    for (std::size_t f = 0; f < files.size(); ++f) {
        EXPECT_EQ(back[f].name, files[f].name);
        EXPECT_TRUE(back[f].bytes == files[f].bytes) << files[f].name;
    }
    EXPECT_NE(body_of(bytes_in(back.back().bytes), 255), nullptr);
    // A body that nobody has rounded does not come back as it was.
    EXPECT_THROW(
        packed_for_transport({{"body-00000000000000ff.bin", bytes_of(small_body(1), 255)}}, small_tube()),
        io::InputError);
    EXPECT_THROW(packed_for_transport({{"other.bin", ""}}, small_tube()), io::InputError);
    EXPECT_THROW(packed_for_transport({{"field-0123456789abcdef.bin", ""}}, small_tube()), io::InputError);
}

TEST(Transport, EveryDamageIsRefusedInASentence) {
    const std::string& whole = small_exercise().bytes;
    for (unsigned seed = 1; seed <= 1000; ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        std::mt19937 random(seed);
        std::string bytes = whole;
        // Half of them in the heads.
        const std::size_t within = seed % 2 ? std::min<std::size_t>(bytes.size(), 120) : bytes.size();
        const unsigned kind = seed / 2 % 3;
        if (kind == 0) bytes.resize(random() % within);
        if (kind == 1) bytes[random() % within] ^= static_cast<char>(1 << random() % 8);
        if (kind == 2)
            for (int n = 0; n < 8; ++n) bytes[random() % within] = static_cast<char>(random());
        if (bytes == whole) continue;
        try {
            static_cast<void>(unpacked_from_transport(bytes_in(bytes)));
            ADD_FAILURE() << "it was taken";
        } catch (const io::InputError& error) {
            EXPECT_GT(std::strlen(error.what()), 10u);
        }
    }
}

TEST(Transport, NothingHappensThoughChecksumsHideTheDamage) {
    const std::string& whole = small_exercise().bytes;
    for (unsigned seed = 1; seed <= 60; ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        std::mt19937 random(seed);
        std::string bytes = whole;
        for (unsigned n = 0; n <= seed % 4; ++n)
            bytes[40 + random() % (seed % 2 ? bytes.size() - 40 : 200)] ^=
                static_cast<char>(1 << random() % 8);
        seal(bytes);
        try {
            static_cast<void>(unpacked_from_transport(bytes_in(bytes)));
        } catch (const io::InputError&) {
        }
    }
    // Bodies alone: each damage reaches what reads them.
    const std::string body = packed_body(small_rounded_body(3));
    for (unsigned seed = 1; seed <= 1000; ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        std::mt19937 random(seed);
        std::string bytes = body;
        if (seed % 4 == 0)
            bytes.resize(random() % bytes.size());
        else
            bytes[random() % (seed % 2 ? bytes.size() : 100)] ^= static_cast<char>(1 << random() % 8);
        try {
            static_cast<void>(unpacked_body(bytes_in(bytes), std::size_t{1} << 22));
        } catch (const std::runtime_error&) {
        }
    }
}

}  // namespace exercise
