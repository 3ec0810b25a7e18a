#include "render/patient/organ_motion.h"

#include <cmath>
#include <gtest/gtest.h>
#include <limits>

#include "physics/geometry/random.h"
#include "render/patient/patient.h"
#include "render/patient/solids.h"
#include "render/picture/fast_math.h"
#include "render/xray/path_length.h"

namespace {

using geometry::Vec3;
using render::Field;
using render::TissueLayer;

render::CArm arm_over_organs() {
    return render::CArm{.detector_width = 220.0, .pixels = 96};
}

/// A body with a ball that breathes and another that beats and takes iodine.
std::vector<TissueLayer> moving_balls(const Vec3& breath, const Vec3& beat) {
    std::vector<TissueLayer> layers(3);
    layers[0] = {"body", render::Material::SoftTissue, render::Material::Air,
                 render::ellipsoid(Vec3::Zero(), Vec3(140, 80, 160))};
    layers[1] = {"gas", render::Material::Air, render::Material::SoftTissue,
                 render::ellipsoid(Vec3(20, 0, 10), Vec3(25, 20, 15))};
    layers[2] = {"kidney", render::Material::SoftTissue, render::Material::Adipose,
                 render::ellipsoid(Vec3(-30, 0, 0), Vec3(12, 14, 20))};
    layers[2].perfused = true;
    for (int k : {1, 2}) {
        layers[k].breath.assign(layers[k].mesh.vertices.size(), breath.cast<float>());
        layers[k].beat.assign(layers[k].mesh.vertices.size(), beat.cast<float>());
    }
    layers[1].drift.assign(layers[1].mesh.vertices.size(), Eigen::Vector3f(3, 0, 3));
    return layers;
}

render::Exposure pulse_at(double breath, double beat) {
    return render::Exposure{.kvp = 74, .organs = {{2, 4.0}}, .breath = breath, .beat = beat};
}

}  // namespace

TEST(OrganMotion, PathLengthsAreThoseOfTheDisplacedMesh) {
    const geometry::TriangleMesh ball = render::ellipsoid(Vec3(5, 3, -4), Vec3(30, 20, 25));
    geometry::Random random(7);
    std::vector<Eigen::Vector3f> breath, beat;
    for (std::size_t i = 0; i < ball.vertices.size(); ++i) {
        breath.emplace_back(0.5f, -1.0f, -12.0f);
        beat.emplace_back(-3.0f, 2.0f, 1.0f);
    }
    render::PathLengthRenderer renderer;
    const int moving = renderer.add(ball, breath, beat), still = renderer.add(ball);
    EXPECT_EQ(renderer.render(moving, arm_over_organs()).length.values,
              renderer.render(still, arm_over_organs()).length.values);
    for (int k = 0; k < 6; ++k) {
        const double b = k < 2 ? k : random(), s = k < 2 ? 1 - k : random();
        geometry::TriangleMesh displaced = ball;
        for (Vec3& v : displaced.vertices) v += b * Vec3(0.5, -1, -12) + s * Vec3(-3, 2, 1);
        const Field there = renderer.render(moving, arm_over_organs(), {b, s}).length,
                    expected = renderer.render(renderer.add(displaced), arm_over_organs()).length;
        int far = 0;
        for (std::size_t i = 0; i < there.values.size(); ++i)
            far += std::abs(there.values[i] - expected.values[i]) > 0.01f;
        EXPECT_LE(far, 2) << "phases " << b << ", " << s;
    }
    breath.pop_back();
    EXPECT_THROW(renderer.add(ball, breath, beat), std::invalid_argument);
}

TEST(OrganMotion, ImagesFollowThePhasesAndNothingElse) {
    ASSERT_EQ(render::fast_exp(0.0f), 1.0f);
    const Vec3 breath(0, 0, -12), beat(4, 0, 0);
    render::Fluoroscope moving({}, moving_balls(breath, beat)), again({}, moving_balls(breath, beat));
    std::vector<TissueLayer> at_rest = moving_balls(breath, beat);
    for (TissueLayer& layer : at_rest) layer.breath.clear(), layer.beat.clear(), layer.drift.clear();
    render::Fluoroscope still({}, std::move(at_rest));
    const render::CArm arm = arm_over_organs();
    const render::SeenDevices none;
    const Field rest = moving.expected_quanta(arm, none, pulse_at(0, 0));
    EXPECT_EQ(rest.values, still.expected_quanta(arm, none, pulse_at(0, 0)).values);
    EXPECT_EQ(rest.values, still.expected_quanta(arm, none, pulse_at(0.7, 0.3)).values);
    geometry::Random random(11);
    std::vector<std::pair<double, double>> phases{{1, 0},    {0, 1},       {1, 1},
                                                  {0.25, 0}, {0, 2.0 / 3}, {1e-9, 1e-9}};
    for (int k = 0; k < 10; ++k) {
        const double b = random(), s = random();
        phases.emplace_back(b, s);
    }
    std::vector<Field> seen;
    for (const auto& [b, s] : phases) {
        seen.push_back(moving.expected_quanta(arm, none, pulse_at(b, s)));
        for (const float q : seen.back().values) ASSERT_TRUE(std::isfinite(q) && q >= 0.0f);
    }
    // In another order, from other caches, and at rest again: the same bits.
    for (std::size_t k = phases.size(); k-- > 0;)
        EXPECT_EQ(again.expected_quanta(arm, none, pulse_at(phases[k].first, phases[k].second)).values,
                  seen[k].values)
            << "phases " << phases[k].first << ", " << phases[k].second;
    EXPECT_EQ(moving.expected_quanta(arm, none, pulse_at(0, 0)).values, rest.values);
    // What is drawn ahead changes nothing; in the end nothing is left to draw.
    render::Fluoroscope ahead({}, moving_balls(breath, beat));
    EXPECT_FALSE(ahead.draw_ahead(arm, pulse_at(0, 0))) << "there is no pose yet";
    ahead.expected_quanta(arm, none, pulse_at(0, 0));
    int parts = 0;
    while (ahead.draw_ahead(arm, pulse_at(0.5, 0))) {
        if (++parts == 5) {
            EXPECT_EQ(ahead.expected_quanta(arm, none, pulse_at(1, 1)).values, seen[2].values);
        }
        ASSERT_LT(parts, 400);  // 4 × 4 × 5 phases, of layers and their images
    }
    EXPECT_GT(parts, 9);
    for (std::size_t k = 0; k < phases.size(); ++k)
        EXPECT_EQ(ahead.expected_quanta(arm, none, pulse_at(phases[k].first, phases[k].second)).values,
                  seen[k].values);
    render::CArm turned = arm;
    turned.lao = 0.3;
    EXPECT_FALSE(ahead.draw_ahead(turned, pulse_at(0, 0))) << "it is another pose";
    render::Exposure carried = pulse_at(0, 0);
    carried.drift = 0.75;
    EXPECT_NE(moving.expected_quanta(arm, none, carried).values, rest.values);
    EXPECT_EQ(moving.expected_quanta(arm, none, carried).values,
              again.expected_quanta(arm, none, carried).values);
    // At a cached phase the image is that of the displaced organs, but for the exposure and its scatter.
    std::vector<TissueLayer> displaced = moving_balls(breath, beat);
    for (int k : {1, 2})
        for (Vec3& v : displaced[k].mesh.vertices) v += breath;
    for (TissueLayer& layer : displaced) layer.breath.clear(), layer.beat.clear(), layer.drift.clear();
    render::Fluoroscope there({}, std::move(displaced));
    const Field expected = there.expected_quanta(arm, none, pulse_at(0, 0));
    double difference = 0, change = 0;
    for (std::size_t i = 0; i < expected.values.size(); ++i) {
        difference += std::abs(std::log(seen[0].values[i] / expected.values[i]));
        change += std::abs(std::log(rest.values[i] / expected.values[i]));
    }
    EXPECT_LT(difference, 0.3 * change);
    for (const double wrong :
         {-0.1, render::largest_breath + 0.1, std::numeric_limits<double>::quiet_NaN()}) {
        EXPECT_THROW(moving.expected_quanta(arm, none, pulse_at(wrong, 0)), std::invalid_argument);
        EXPECT_THROW(moving.expected_quanta(arm, none, pulse_at(0, std::min(wrong, 1.1))),
                     std::invalid_argument);
        render::Exposure far = pulse_at(0, 0);
        far.drift = wrong;
        EXPECT_THROW(moving.expected_quanta(arm, none, far), std::invalid_argument);
    }
}

TEST(OrganMotion, MovesOrgansByWhatIsPublished) {
    render::PatientSpec spec;
    spec.lower = Vec3(-60, -60, 0);
    spec.upper = Vec3(60, 60, 330);
    spec.origin = Vec3(4, -6, 9);
    std::vector<TissueLayer> layers = render::make_patient(spec);
    const auto systole = [](const Vec3& x) { return Vec3(-0.1 * x.x(), 0, 0); };
    render::move_organs(layers, spec.origin, 14, systole);
    const auto of = [&](const std::string& name) -> const TissueLayer& {
        return *std::find_if(layers.begin(), layers.end(),
                             [&](const TissueLayer& layer) { return layer.name == name; });
    };
    for (const char* still : {"bones", "marrow", "body", "fat", "trunk", "airway"}) {
        EXPECT_TRUE(of(still).breath.empty()) << still;
        EXPECT_TRUE(of(still).beat.empty()) << still;
    }
    const auto descent = [](const TissueLayer& layer, double part) {  // of the height from below
        double low = 1e9, high = -1e9, sum = 0;
        for (const Vec3& v : layer.mesh.vertices) low = std::min(low, v.z()), high = std::max(high, v.z());
        int count = 0;
        for (std::size_t i = 0; i < layer.mesh.vertices.size(); ++i) {
            if (std::abs(layer.mesh.vertices[i].z() - (low + part * (high - low))) > 0.06 * (high - low))
                continue;
            sum -= layer.breath[i].z();
            ++count;
        }
        return sum / std::max(count, 1);
    };
    EXPECT_GT(descent(of("diaphragm"), 0.9), 10);
    EXPECT_LT(descent(of("diaphragm"), 0.9), 17);
    EXPECT_LT(descent(of("left lung"), 0.98), 2);
    EXPECT_GT(descent(of("left lung"), 0.15), 9);
    EXPECT_NEAR(descent(of("left kidney"), 0.5), 10, 3);
    for (const char* beats : {"heart", "left lung", "right lung", "lung vessels"}) {
        const TissueLayer& layer = of(beats);
        ASSERT_EQ(layer.beat.size(), layer.mesh.vertices.size());
        for (std::size_t i = 0; i < layer.beat.size(); ++i)
            ASSERT_EQ(layer.beat[i], systole(layer.mesh.vertices[i]).cast<float>()) << beats;
    }
    // At full inspiration the meshes are still closed, for they keep their triangles, and not inside out.
    for (TissueLayer& layer : layers) {
        if (layer.breath.empty()) continue;
        for (std::size_t i = 0; i < layer.breath.size(); ++i)
            layer.mesh.vertices[i] += layer.breath[i].cast<double>();
        EXPECT_EQ(render::unmatched_edges(layer.mesh), 0) << layer.name;
    }
    // Bubbles go their own ways, each as a whole.
    TissueLayer& gas = const_cast<TissueLayer&>(of("bowel gas"));
    ASSERT_EQ(gas.drift.size(), gas.mesh.vertices.size());
    double up = 0, down = 0;
    for (std::size_t i = 0; i < gas.drift.size(); ++i) {
        ASSERT_GE(gas.drift[i].norm(), 2.99f);
        ASSERT_LE(gas.drift[i].norm(), 7.01f);
        up = std::max<double>(up, gas.drift[i].z());
        down = std::min<double>(down, gas.drift[i].z());
        gas.mesh.vertices[i] += gas.drift[i].cast<double>();
    }
    EXPECT_GT(up, 2);
    EXPECT_LT(down, -2);
    EXPECT_EQ(render::unmatched_edges(gas.mesh), 0);
    for (const TissueLayer& layer : layers)
        EXPECT_TRUE(layer.name == "bowel gas" || layer.drift.empty()) << layer.name;
}
