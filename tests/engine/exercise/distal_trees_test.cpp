#include "engine/exercise/distal_trees.h"

#include <cmath>
#include <gtest/gtest.h>

#include "engine/exercise/imaging.h"
#include "physics/geometry/mesh_query.h"
#include "tests/anatomies.h"

namespace exercise {

TEST(DistalTrees, FillTheirOrgansDownToTheSmallestArteries) {
    const anatomy::Anatomy& vessels = test::iliac_renal();
    const blood::ContrastFlow contrast(vessels);
    const std::vector<render::TissueLayer> layers = tissue_layers(scenario::Scenario{}, vessels);
    const auto pieces = distal_trees(vessels, contrast.blood(), layers);
    EXPECT_EQ(distal_iodine(contrast).size(), distal_nodes(contrast.blood()));
    constexpr int bins = blood::DistalArteries::bins;
    const auto& outlets = contrast.blood().outlets;
    for (std::size_t k = 0; k < outlets.size(); ++k) {
        double least = 100, most = 0;
        std::size_t own = 0, first_bin = 0, inside = 0;
        const auto kidney = std::find_if(layers.begin(), layers.end(), [&](const auto& layer) {
            return layer.name == (outlets[k].place.x() > 0 ? "left kidney" : "right kidney");
        });
        ASSERT_NE(kidney, layers.end());
        const geometry::MeshQuery query(kidney->mesh);
        for (const render::VesselPiece& piece : pieces) {
            if (piece.node / bins != k) continue;
            ++own;
            least = std::min<double>(least, piece.radius), most = std::max<double>(most, piece.radius);
            first_bin += piece.node % bins == 0;
            if (outlets[k].organ == "kidney") inside += query.encloses(piece.to.cast<double>());
        }
        EXPECT_GT(own, 100u) << outlets[k].end;
        EXPECT_GT(first_bin, 0u) << outlets[k].end;
        EXPECT_NEAR(least, 0.15, 0.01) << outlets[k].end;
        EXPECT_NEAR(most, outlets[k].radius, 1e-6) << outlets[k].end;
        if (outlets[k].organ == "kidney") {
            EXPECT_GT(inside, own * 9 / 10) << outlets[k].end;
        }
    }
    const auto again = distal_trees(vessels, contrast.blood(), layers);
    ASSERT_EQ(again.size(), pieces.size());
    for (std::size_t i = 0; i < pieces.size(); ++i) EXPECT_EQ(again[i].to, pieces[i].to);
}

namespace {

/// Of an artery's darkness where its lumen ends and its tree begins, in parts of what balls of its radius all
/// along it cast: the largest step from one place to the next, and the largest difference. It is seen alone,
/// from the side, with its widest branch at every fork.
struct Steps {
    double next = 0, off = 0;
    int seen = 0;  // places
};

Steps steps_at(const anatomy::Anatomy& vessels, const blood::BloodFlow& blood,
               const std::vector<render::VesselPiece>& pieces, std::size_t outlet) {
    const blood::Outlet& end = blood.outlets[outlet];
    struct Station {
        geometry::Vec3 place;
        double radius;
    };
    std::vector<Station> way;
    for (int cell = end.cell, k = 0; cell >= 0 && k < 12; cell = blood.cells[cell].upstream, ++k)
        way.insert(way.begin(), {blood.cells[cell].centre, blood.cells[cell].radius});
    // Down the tree, along the widest branch.
    constexpr int bins = blood::DistalArteries::bins;
    std::vector<render::VesselPiece> own, chain;
    for (const render::VesselPiece& piece : pieces)
        if (piece.node / bins == outlet) own.push_back(piece);
    geometry::Vec3 at = end.place;
    while (chain.size() < 400) {
        const render::VesselPiece* next = nullptr;
        for (const render::VesselPiece& piece : own)
            if ((piece.from.cast<double>() - at).norm() < 1e-4 && (!next || piece.radius > next->radius))
                next = &piece;
        if (!next || next->radius < 0.4 * end.radius) break;
        chain.push_back(*next);
        way.push_back({(next->from + next->to).cast<double>() / 2, next->radius});
        at = next->to.cast<double>();
    }
    render::CArm arm;
    // Across the first part of the way.
    const geometry::Vec3 ahead =
        (way[std::min<std::size_t>(way.size() - 1, 20)].place - way[8].place).normalized();
    double best = 1;
    for (const double lao : {0.0, 45.0, 90.0, -45.0}) {
        render::CArm tried;
        tried.lao = lao * geometry::degree;
        const double along = std::abs(render::axes(tried).beam.dot(ahead));
        if (along < best) best = along, arm.lao = tried.lao;
    }
    arm.isocentre = end.place;
    arm.detector_width = 70;
    const geometry::TriangleMesh lumen = anatomy::closed_lumen(vessels);
    std::vector<geometry::Vec3> centres;
    std::vector<float> radii, iodine(blood.cells.size(), 0.0f), distal(distal_nodes(blood), 1.0f);
    for (const blood::FlowCell& cell : blood.cells) {
        centres.push_back(cell.centre);
        radii.push_back(static_cast<float>(cell.radius));
    }
    for (int cell = end.cell, k = 0; cell >= 0 && k < 12; cell = blood.cells[cell].upstream, ++k)
        iodine[cell] = 1;
    render::Field seen(arm.pixels, arm.pixels);
    render::iodine_thickness(render::LumenContrast(lumen, centres, radii).at(arm), iodine, seen);
    std::vector<std::uint32_t> touched;
    render::add_iodine(render::DistalVessels(chain, distal_nodes(blood)).at(arm), distal, {}, seen, touched);
    const auto darkness = [&](double x, double y) {
        const int i = static_cast<int>(std::floor(x - 0.5)), j = static_cast<int>(std::floor(y - 0.5));
        const double u = x - 0.5 - i, v = y - 0.5 - j;
        const auto value = [&](int a, int b) {
            return double{seen.values[static_cast<std::size_t>(b) * arm.pixels + a]};
        };
        return (1 - v) * ((1 - u) * value(i, j) + u * value(i + 1, j)) +
               v * ((1 - u) * value(i, j + 1) + u * value(i + 1, j + 1));
    };
    // What rays have of balls all along the way.
    const auto expected = [&](const render::Pixel& pixel) {
        const geometry::Vec3 ray = render::ray_direction(arm, pixel.x, pixel.y),
                             source = arm.isocentre - arm.sod * render::axes(arm).beam;
        std::vector<std::pair<double, double>> inside;
        for (std::size_t k = 0; k + 1 < way.size(); ++k)
            for (double t = 0; t < 1; t += 0.1) {
                const geometry::Vec3 middle = (1 - t) * way[k].place + t * way[k + 1].place;
                const double radius = (1 - t) * way[k].radius + t * way[k + 1].radius;
                const double along = (middle - source).dot(ray),
                             aside = (middle - source - along * ray).squaredNorm();
                if (aside >= radius * radius) continue;
                const double half = std::sqrt(radius * radius - aside);
                inside.emplace_back(along - half, along + half);
            }
        std::sort(inside.begin(), inside.end());
        double sum = 0, until = 0;
        for (const auto& [from, to] : inside) {
            sum += std::max(0.0, to - std::max(from, until));
            until = std::max(until, to);
        }
        return sum;
    };
    Steps steps;
    double before = -1;
    for (std::size_t k = 10; k + 2 < way.size(); ++k) {
        if ((way[k].place - end.place).norm() > std::min(18.0, 8 * end.radius)) break;
        const render::Pixel pixel = render::project(arm, way[k].place);
        const double wanted = expected(pixel);
        // Where it runs along the beam or over itself it is darker, and blurred.
        if (wanted > 1.6 * 2 * way[k].radius) {
            before = -1;
            continue;
        }
        const double part = darkness(pixel.x, pixel.y) / wanted;
        ++steps.seen;
        steps.off = std::max(steps.off, std::abs(part - 1));
        if (before >= 0) steps.next = std::max(steps.next, std::abs(part - before));
        before = part;
    }
    return steps;
}

}  // namespace

TEST(DistalTrees, NoStepWhereALumenEnds) {
    for (const char* preset : {"iliac-renal", "lca", "cerebral"}) {
        const anatomy::Anatomy vessels =
            anatomy::generated_anatomy(anatomy::vessel_preset(preset), test::cache());
        const blood::ContrastFlow contrast(vessels);
        const auto pieces =
            distal_trees(vessels, contrast.blood(), tissue_layers(scenario::Scenario{}, vessels));
        const auto& outlets = contrast.blood().outlets;
        for (std::size_t k = 0; k < outlets.size(); ++k) {
            if (!(outlets[k].arterial > 0)) continue;
            const Steps steps = steps_at(vessels, contrast.blood(), pieces, k);
            EXPECT_GE(steps.seen, 3) << preset << ": " << outlets[k].end;
            EXPECT_LT(steps.next, 0.15) << preset << ": " << outlets[k].end;
            EXPECT_LT(steps.off, 0.15) << preset << ": " << outlets[k].end;
        }
    }
}

TEST(DistalTrees, ContrastGivenAtTheBeginningHasNoEdgeThere) {
    blood::ContrastFlow contrast(test::iliac_renal());
    contrast.inject({std::string("aorta"), 20, 20, 300});
    for (int frame = 0; frame < 6; ++frame) contrast.step(1.0 / 15);
    const std::vector<float> shown = lumen_iodine(contrast);
    const blood::BloodFlow& blood = contrast.blood();
    const auto source = static_cast<std::size_t>(blood.sources[0].cell);
    const int entry = blood.entry_of(blood.cells[source].branch);
    EXPECT_LT(contrast.iodine()[source], 0.5f * contrast.iodine()[static_cast<std::size_t>(entry)]);
    EXPECT_EQ(shown[source], contrast.iodine()[static_cast<std::size_t>(entry)]);
    EXPECT_EQ(distal_iodine(contrast)[blood.outlets.size() * blood::DistalArteries::bins], shown[source]);
    for (std::size_t i = static_cast<std::size_t>(entry); i < shown.size(); ++i)
        EXPECT_EQ(shown[i], contrast.iodine()[i]);
}

TEST(DistalTrees, VeinsLeadOnFromWhatArteriesSupply) {
    const anatomy::Anatomy vessels =
        anatomy::generated_anatomy(anatomy::vessel_preset("cerebral"), test::cache());
    const blood::ContrastFlow contrast(vessels);
    const auto pieces = distal_trees(vessels, contrast.blood(), tissue_layers(scenario::Scenario{}, vessels));
    const std::size_t arteries =
        contrast.blood().outlets.size() * blood::DistalArteries::bins + contrast.blood().sources.size();
    const std::uint32_t nodes = distal_nodes(contrast.blood());
    EXPECT_EQ(distal_iodine(contrast).size(), nodes);
    EXPECT_EQ(distal_moves(contrast.blood(),
                           std::vector<Eigen::Vector3f>(contrast.nodes().size(), Eigen::Vector3f(1, 2, 3)))
                  .size(),
              nodes);
    double veins = 0, in_sinuses = 0, highest = -1e9, lowest = 1e9;
    for (const render::VesselPiece& piece : pieces) {
        ASSERT_TRUE(piece.from.allFinite() && piece.to.allFinite());
        ASSERT_LT(piece.node, nodes);
        if (piece.node < arteries) continue;
        const double length = static_cast<double>((piece.to - piece.from).norm());
        veins += length;
        if (piece.node >= nodes - blood::DistalArteries::bins) in_sinuses += length;
        highest = std::max(highest, static_cast<double>(piece.to.z()));
        lowest = std::min(lowest, static_cast<double>(piece.to.z()));
    }
    // From the vertex to the neck, sinuses and what leads to them.
    EXPECT_GT(veins, 2000);
    EXPECT_GT(in_sinuses, 700);
    EXPECT_GT(highest - lowest, 180);
}

}  // namespace exercise
