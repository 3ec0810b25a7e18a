#include "physics/field_sampler.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <stdexcept>
#include <string>

#include "physics/parallel.h"

namespace physics {
namespace {

/// A sheet's field reaches this many radii from its centreline: lumens are not round.
constexpr double kRoundness = 1.5;
/// Spacings that the grids reach past an open end.
constexpr double kPastEnds = 4;
/// Bricks along the edge of the cubes that the search for the wall starts from, a power of two.
constexpr int kCube = 4;

/// The vessel wall that a triangle belongs to: of the stations it faces away from, the one whose ball is
/// nearest. Facing tells apart the walls of two vessels that nearly touch.
int station_of(const LumenSurface& surface, int triangle, std::span<const Station> stations) {
    const Vec3 x = surface.centroid(triangle), normal = surface.area_normal(triangle);
    int best = -1, any = 0;
    double least = 0, least_any = stations[0].power(x);
    for (int s = 0; s < static_cast<int>(stations.size()); ++s) {
        const double p = stations[s].power(x);
        if (p < least_any) least_any = p, any = s;
        if ((best < 0 || p < least) && normal.dot(x - stations[s].centre) > 0) least = p, best = s;
    }
    return best < 0 ? any : best;
}

/// The stations of a sheet in runs, each in a sphere, so that a search passes over most of them.
class StationRuns {
public:
    StationRuns(std::span<const Station> stations, std::span<const int> sheet)
        : stations_(stations), sheet_(sheet) {
        for (std::size_t first = 0; first < sheet.size(); first += kLength) {
            const auto run = sheet.subspan(first, std::min(kLength, sheet.size() - first));
            Sphere sphere{run, stations[run[run.size() / 2]].centre};
            for (int s : run) {
                sphere.reach = std::max(sphere.reach, (stations[s].centre - sphere.centre).norm());
                sphere.widest = std::max(sphere.widest, stations[s].radius);
            }
            runs_.push_back(sphere);
        }
    }

    /// The first of those that hold x deepest. `seed`: one that is likely to, -1 = none.
    int deepest(const Vec3& x, int seed) const {
        int best = seed >= 0 ? seed : sheet_.front();
        double least = stations_[best].power(x);
        for (const Sphere& run : runs_) {
            const double gap = std::max(0.0, (x - run.centre).norm() - run.reach);
            if (gap * gap - run.widest * run.widest > least + kRounding) continue;
            for (int s : run.stations) {
                const double p = stations_[s].power(x);
                if (p < least || (p == least && s < best)) least = p, best = s;
            }
        }
        return best;
    }
    /// Whether x is within kRoundness radii and a margin [mm] of a station.
    bool near(const Vec3& x, double margin) const {
        return std::any_of(runs_.begin(), runs_.end(), [&](const Sphere& run) {
            const double most = run.reach + kRoundness * run.widest + margin + kRounding;
            if ((x - run.centre).squaredNorm() > most * most) return false;
            return std::any_of(run.stations.begin(), run.stations.end(), [&](int s) {
                const double limit = kRoundness * stations_[s].radius + margin;
                return (x - stations_[s].centre).squaredNorm() < limit * limit;
            });
        });
    }

private:
    static constexpr std::size_t kLength = 16;
    static constexpr double kRounding = 1e-6;
    struct Sphere {
        std::span<const int> stations;
        Vec3 centre;
        double reach = 0, widest = 0;  // of the stations' centres, and their largest radius [mm]
    };
    std::span<const Station> stations_;
    std::span<const int> sheet_;
    std::vector<Sphere> runs_;
};

/// The distance to the wall that a place on a sheet sees.
class View {
public:
    View(const LumenSurface& surface, const CentrelineTree& tree, const VesselSheets& sheets,
         const std::vector<StationRuns>& runs, const std::vector<int>& station_of_triangle,
         const FindNearest& nearest, double margin)
        : surface_(surface),
          tree_(tree),
          sheets_(sheets),
          runs_(runs),
          station_of_triangle_(station_of_triangle),
          nearest_(nearest),
          margin_(margin),
          seen_(tree.stations().size(), 0) {}

    /// Looks from the station of a sheet that holds x deepest.
    void look_from(int sheet, const Vec3& x) {
        const bool same = station_ >= 0 && sheets_.sheet_of[station_] == sheet;
        const int best = runs_[sheet].deepest(x, same ? station_ : -1);
        if (best == station_) return;
        if (station_ >= 0)
            for (int s : sheets_.seen[station_]) seen_[s] = 0;
        for (int s : sheets_.seen[best]) seen_[s] = 1;
        station_ = best;
    }

    double beyond_an_end(const Vec3& x) const {
        double out = 0;
        for (int e : sheets_.ends[station_]) out = std::max(out, tree_.ends()[e].beyond(x, margin_));
        return out;
    }

    /// Signed distance, negative inside. Beyond an open end the wall goes on straight.
    double distance(Vec3 x) {
        for (int e : sheets_.ends[station_]) {
            const OpenEnd& end = tree_.ends()[e];
            x -= end.beyond(x, margin_) * end.outward_normal;
        }
        const NearestTriangle found = nearest_(x, seed_, seen_, station_of_triangle_);
        if (found.triangle < 0) return to_balls(x);
        seed_ = found.triangle;
        const double d = std::sqrt(found.at.square_distance);
        const Vec3 normal = surface_.pseudo_normal(found.triangle, found.at.feature);
        if (normal.dot(x - found.at.point) < 0) return -d;
        // What lies well within an inscribed ball is inside, whatever a damaged mesh says.
        const bool doubtful = d > 0.3 * tree_.stations()[station_].radius;
        return doubtful && well_inside(x) ? -d : d;
    }

private:
    double to_balls(const Vec3& x) const {
        double least = std::numeric_limits<double>::max();
        for (int s : sheets_.seen[station_]) {
            const Station& station = tree_.stations()[s];
            least = std::min(least, (x - station.centre).norm() - station.radius);
        }
        return least;
    }
    bool well_inside(const Vec3& x) const {
        return std::any_of(sheets_.seen[station_].begin(), sheets_.seen[station_].end(), [&](int s) {
            const Station& station = tree_.stations()[s];
            return (x - station.centre).squaredNorm() < 0.5 * station.radius * station.radius;
        });
    }

    const LumenSurface& surface_;
    const CentrelineTree& tree_;
    const VesselSheets& sheets_;
    const std::vector<StationRuns>& runs_;  // per sheet
    const std::vector<int>& station_of_triangle_;
    const FindNearest& nearest_;
    double margin_;  // [mm]
    std::vector<char> seen_;
    int station_ = -1, seed_ = -1;
};

struct Cube {
    int sheet;
    SplineGrid::Brick first;  // brick
    int side;                 // [bricks]
};

/// Cubes that cover the reach of every sheet, in a fixed order.
std::vector<Cube> cubes(const CentrelineTree& tree, const VesselSheets& sheets, const FieldBand& band) {
    std::vector<Cube> all;
    const double edge = kCube * SplineGrid::kSide * band.spacing;
    for (std::size_t sheet = 0; sheet < sheets.stations.size(); ++sheet) {
        std::set<SplineGrid::Brick> mine;
        for (int s : sheets.stations[sheet]) {
            const Station& station = tree.stations()[s];
            const double reach = kRoundness * station.radius + band.outer + edge / 2;
            int low[3], high[3];
            for (int d = 0; d < 3; ++d) {
                low[d] = static_cast<int>(std::floor((station.centre[d] - reach) / edge));
                high[d] = static_cast<int>(std::floor((station.centre[d] + reach) / edge));
            }
            for (int i = low[0]; i <= high[0]; ++i)
                for (int j = low[1]; j <= high[1]; ++j)
                    for (int k = low[2]; k <= high[2]; ++k) {
                        const Vec3 offset = edge * Vec3(i + 0.5, j + 0.5, k + 0.5) - station.centre;
                        if (offset.norm() < reach + edge) mine.insert({kCube * i, kCube * j, kCube * k});
                    }
        }
        for (const auto& first : mine) all.push_back({static_cast<int>(sheet), first, kCube});
    }
    return all;
}

/// The search for the bricks from which a cell within the band is served.
struct Search {
    const std::vector<StationRuns>& runs;  // per sheet
    const FieldBand& band;
    View& view;

    /// Whether the band may come into a cube of space.
    bool meets(int sheet, const Vec3& centre, double side) const {
        const double reach = side / 2 * std::numbers::sqrt3;
        if (!runs[sheet].near(centre, band.outer + reach)) return false;
        view.look_from(sheet, centre);
        if (view.beyond_an_end(centre) > reach + kPastEnds * band.spacing) return false;
        const double d = view.distance(centre);
        return d <= band.outer + reach && d >= -band.inner - reach;
    }

    void serve(const Cube& cube, std::vector<SplineGrid::Brick>& bricks) const {
        // The cells that a brick serves begin one node after its first.
        const double h = band.spacing, side = cube.side * SplineGrid::kSide * h;
        Vec3 low;
        for (int d = 0; d < 3; ++d) low[d] = (SplineGrid::kSide * cube.first[d] + 1) * h;
        if (!meets(cube.sheet, low + Vec3::Constant(side / 2), side)) return;
        const int half = cube.side / 2;
        for (int n = 0; n < 8; ++n) {
            const int i = n >> 2, j = n >> 1 & 1, k = n & 1;
            if (half > 0) {
                const auto& f = cube.first;
                serve({cube.sheet, {f[0] + half * i, f[1] + half * j, f[2] + half * k}, half}, bricks);
            } else if (meets(cube.sheet, low + side / 4 * Vec3(2 * i + 1, 2 * j + 1, 2 * k + 1), side / 2)) {
                bricks.push_back(cube.first);
                return;
            }
        }
    }
};

/// Refuses a field whose bricks would take more memory than allowed, in building or after.
void check_size(double bricks, const FieldBand& band) {
    constexpr double kBytes = 2 * 4 * SplineGrid::kNodes + 80;  // of a brick while coefficients are fitted
    if (bricks * kBytes <= static_cast<double>(band.largest)) return;
    throw std::invalid_argument("a distance field of spacing " + std::to_string(band.spacing) +
                                " mm would take " + std::to_string(std::llround(bricks * kBytes / 1e6)) +
                                " MB, more than the " + std::to_string(band.largest / 1000000) +
                                " MB allowed: choose a wider spacing, and check the unit of the lumen");
}

}  // namespace

LumenSurface lumen_surface(const TriangleMesh& mesh, const CentrelineTree& tree) {
    return LumenSurface(mesh, [&](const Vec3& x) { return tree.stations()[tree.locate(x, -1)].centre; });
}

std::vector<SplineGrid> sampled_grids(const LumenSurface& surface, const CentrelineTree& tree,
                                      const VesselSheets& sheets, const FieldBand& band,
                                      const FindNearest& nearest,
                                      const std::function<void(double)>& progress) {
    const auto stations = tree.stations();
    double area = 0;
    for (std::size_t s = 1; s < stations.size(); ++s)
        if (stations[s].branch == stations[s - 1].branch)
            area += 2 * std::numbers::pi * stations[s].radius *
                    (stations[s].centre - stations[s - 1].centre).norm();
    const double edge = SplineGrid::kSide * band.spacing;
    check_size(area * (band.inner + band.outer) / (edge * edge * edge), band);

    std::vector<int> station_of_triangle(surface.count());
    parallel_for(surface.count(), band.threads,
                 [&](std::size_t t) { station_of_triangle[t] = station_of(surface, t, stations); });

    std::vector<StationRuns> runs;
    for (const auto& sheet : sheets.stations) runs.emplace_back(stations, sheet);
    auto part = [&](double from, double to) {
        return [&progress, from, to](double share) {
            if (progress) progress(from + (to - from) * share);
        };
    };
    const std::vector<Cube> starts = cubes(tree, sheets, band);
    std::vector<std::vector<SplineGrid::Brick>> served(starts.size());
    parallel_for(
        starts.size(), band.threads,
        [&](std::size_t c) {
            View view(surface, tree, sheets, runs, station_of_triangle, nearest, band.outer);
            Search{runs, band, view}.serve(starts[c], served[c]);
        },
        part(0.05, 0.3));

    std::vector<std::vector<SplineGrid::Brick>> bricks(sheets.stations.size());
    double total = 0;
    for (std::size_t c = 0; c < starts.size(); ++c)
        for (const auto& b : served[c])
            for (int n = 0; n < 8; ++n)
                bricks[starts[c].sheet].push_back({b[0] + (n >> 2), b[1] + (n >> 1 & 1), b[2] + (n & 1)});
    for (auto& b : bricks) {
        std::sort(b.begin(), b.end());
        b.erase(std::unique(b.begin(), b.end()), b.end());
        total += static_cast<double>(b.size());
    }
    check_size(total, band);

    std::vector<SplineGrid> grids;
    std::vector<std::pair<int, std::size_t>> work;  // grid, brick
    for (std::size_t g = 0; g < bricks.size(); ++g) {
        grids.emplace_back(band.spacing, std::move(bricks[g]));
        for (std::size_t b = 0; b < grids[g].bricks(); ++b) work.push_back({static_cast<int>(g), b});
    }
    parallel_for(
        work.size(), band.threads,
        [&](std::size_t w) {
            const auto [g, b] = work[w];
            View view(surface, tree, sheets, runs, station_of_triangle, nearest, band.outer);
            constexpr int n = SplineGrid::kSide;
            view.look_from(g, grids[g].place(b, n / 2, n / 2, n / 2));
            auto value = grids[g].nodes(b).begin();
            for (int i = 0; i < n; ++i)
                for (int j = 0; j < n; ++j)
                    for (int k = 0; k < n; ++k)
                        *value++ = static_cast<float>(view.distance(grids[g].place(b, i, j, k)));
        },
        part(0.3, 1.0));
    for (SplineGrid& grid : grids) grid.fit(band.threads);
    if (progress) progress(1.0);
    return grids;
}

}  // namespace physics
