#include "physics/wall/packed_values.h"

#include <gtest/gtest.h>
#include <random>
#include <sstream>

#include "physics/wall/distance_field.h"
#include "tests/anatomies.h"

using namespace physics;

namespace {

struct Sampled {
    CentrelineTree tree;
    VesselSheets sheets;
    LumenSurface surface;

    explicit Sampled(const anatomy::Anatomy& anatomy, double outer)
        : tree(anatomy.branches, anatomy.openings()),
          sheets(vessel_sheets(tree, [outer](double) { return outer + 0.6; })),
          surface(lumen_surface(anatomy.lumen, tree)) {}
    std::vector<SheetField> values(const FieldBand& band) const {
        return sampled_values(surface, tree, sheets, band, {});
    }
};

constexpr FieldBand band{0.4, 0.6, 0.5, 3.0, 2, std::size_t{1} << 30};

const Sampled& iliac() {
    static const Sampled sampled(test::iliac_renal(), band.outer);
    return sampled;
}

std::string bytes_of(const std::vector<SheetField>& fields) {
    std::string bytes;
    for (const SheetField& field : fields)
        for (const SplineGrid& grid : field.grids) grid.save(bytes);
    return bytes;
}

}  // namespace

TEST(PackedValues, ComeBackWithEqualBitsAsLessThanAFifthOfTheBytes) {
    const std::vector<SheetField> values = iliac().values(band);
    const std::string packed = packed_values(values), bytes = bytes_of(values);
    EXPECT_LT(5 * packed.size(), bytes.size());
    EXPECT_EQ(bytes_of(unpacked_values(std::as_bytes(std::span(packed)), band.spacing, values.size(),
                                       bytes.size())),
              bytes);
}

TEST(PackedValues, TheirRoundingMovesTheWallByLessThanAFewMicrometres) {
    FieldBand exact = band;
    exact.step = 0;
    std::vector<SheetField> rounded = iliac().values(band), unrounded = iliac().values(exact);
    fit(rounded, 2);
    fit(unrounded, 2);
    const double most = 125.0 / 27 * value_step / 2;  // see value_step
    std::mt19937 random(5);
    double value = 0, slope = 0, squares = 0;
    int places = 0;
    for (std::size_t f = 0; f < rounded.size(); ++f)
        for (std::size_t l = 0; l < rounded[f].grids.size(); ++l) {
            const SplineGrid& grid = rounded[f].grids[l];
            const double h = grid.spacing();
            for (std::size_t b = 0; b < grid.bricks(); ++b) {
                const double reach = SplineGrid::brick_side * h;
                const Vec3 x = grid.place(b, 0, 0, 0) +
                               reach * Vec3(random() * 0x1p-32, random() * 0x1p-32, random() * 0x1p-32);
                SplineValue a, c;
                if (!grid.evaluate(x, a)) continue;
                ASSERT_TRUE(unrounded[f].grids[l].evaluate(x, c));
                const double slopes = (a.gradient - c.gradient).cwiseAbs().maxCoeff();
                ASSERT_LE(std::abs(a.value - c.value), most + 1e-6);
                ASSERT_LE(slopes, 2 * most / h + 1e-5);
                value = std::max(value, std::abs(a.value - c.value));
                slope = std::max(slope, slopes);
                squares += (a.gradient - c.gradient).squaredNorm();
                ++places;
            }
        }
    EXPECT_GT(places, 3000);
    EXPECT_LT(value, 0.02);  // what contacts are allowed to be off [mm]
    std::printf("  %d places: value off by %.2g mm at most, slope by %.2g, %.2g rms\n", places, value, slope,
                std::sqrt(squares / places));
}

TEST(PackedValues, EveryDamageIsRefusedOrGivesOtherValues) {
    const std::vector<SheetField> values = iliac().values(band);
    std::string packed = packed_values(values);
    const std::size_t largest = 2 * bytes_of(values).size();
    for (unsigned seed = 1; seed <= 60; ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        std::mt19937 random(seed);
        std::string damaged = packed;
        // Most of them early, where what they decide is most.
        const std::size_t within = seed % 2 ? std::min<std::size_t>(damaged.size(), 200) : damaged.size();
        if (seed % 3 == 0)
            damaged.resize(random() % within);
        else
            damaged[random() % within] ^= static_cast<char>(1 << random() % 8);
        try {
            static_cast<void>(
                unpacked_values(std::as_bytes(std::span(damaged)), band.spacing, values.size(), largest));
            EXPECT_NE(seed % 3, 0u);
        } catch (const std::runtime_error&) {
        }
    }
}

TEST(DistanceField, ComesBackFromItsPackedForm) {
    const anatomy::Anatomy& anatomy = test::iliac_renal();
    const DistanceField field(anatomy.lumen, anatomy.branches, anatomy.openings(), 20, 0.4,
                              {.spacing = 0.4, .inner = 0.6, .outer = 0.5, .threads = 2, .packable = true});
    std::ostringstream saved;
    field.save(saved);
    const std::string packed = field.packed(), bytes = std::move(saved).str();
    EXPECT_LT(5 * packed.size(), bytes.size());
    EXPECT_EQ(DistanceField::unpacked(std::as_bytes(std::span(packed)), bytes.size()), bytes);
    EXPECT_THROW(DistanceField::unpacked(std::as_bytes(std::span(packed)).first(100), bytes.size()),
                 std::runtime_error);
    EXPECT_THROW(DistanceField::unpacked(std::as_bytes(std::span(packed)), bytes.size() / 2),
                 std::runtime_error);
}
