#include <algorithm>
#include <array>
#include <cmath>
#include <gtest/gtest.h>
#include <random>

#include "engine/patient/ct_samples.h"

namespace patient {
namespace {

using geometry::Vec3;

/// Mean over a cell of what is linear between samples and constant beyond them, along each axis.
double mean_over(const CtImage& ct, int i, int j, int k) {
    const int at[3] = {i, j, k};
    double sum = 0;
    for (int n = 0; n < 27; ++n) {
        const int off[3] = {n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1};
        double weight = 1;
        int place[3];
        for (int a = 0; a < 3; ++a) {
            weight *= off[a] == 0 ? 0.75 : 0.125;
            place[a] = std::clamp(at[a] + off[a], 0, ct.grid.size[a] - 1);
        }
        sum += weight * ct.hu[ct.grid.index(place[0], place[1], place[2])];
    }
    return sum;
}

CtImage random_ct(std::array<int, 3> size) {
    CtImage ct;
    ct.grid.size = size;
    std::mt19937 random(3);
    for (std::size_t n = 0; n < ct.grid.count(); ++n)
        ct.hu.push_back(static_cast<std::int16_t>(static_cast<int>(random() % 4000) - 1000));
    return ct;
}

}  // namespace

TEST(CellMeans, OfTheSamplesAreWhatTheScannerGave) {
    for (const std::array<int, 3> size : {std::array{9, 7, 8}, std::array{2, 1, 13}, std::array{33, 5, 2}}) {
        const CtImage given = random_ct(size);
        CtImage samples = given;
        interpolate_means(samples);
        for (int k = 0; k < size[2]; ++k)
            for (int j = 0; j < size[1]; ++j)
                for (int i = 0; i < size[0]; ++i)
                    // Samples are rounded twice.
                    EXPECT_NEAR(mean_over(samples, i, j, k), given.hu[given.grid.index(i, j, k)], 1.5);
    }
}

TEST(CellMeans, OfOneTissueStayAsTheyAreAndAnEdgeIsExceededByAFifth) {
    CtImage ct;
    ct.grid.size = {40, 6, 6};
    for (std::size_t n = 0; n < ct.grid.count(); ++n) ct.hu.push_back(n % 40 < 20 ? -1000 : 50);
    interpolate_means(ct);
    EXPECT_EQ(ct.hu[0], -1000);
    EXPECT_EQ(ct.hu[39], 50);
    const double exceeded = (ct.hu[20] - 50) / 1050.0;
    EXPECT_NEAR(exceeded, (std::sqrt(2.0) - 1) / 2, 0.002);
    EXPECT_NEAR(ct.hu[19] + ct.hu[20], -950, 2);
}

}  // namespace patient
