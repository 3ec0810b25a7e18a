#include "physics/wall/foundation.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

namespace physics {
namespace {

/// Elements a length over which a vessel spreads a force: 3 give the way under a single force to 0.1 %.
constexpr double elements_per_length = 3;
constexpr double shortest = 1, longest = 10;  // of an element [mm]

/// (4B/k_f)^¼: the length over which the vessel's own bending spreads a force [mm].
double spread(const Tissue& tissue, double radius) {
    const double bending = std::numbers::pi * std::pow(radius, 4) * tissue.wall;
    return std::pow(4 * bending / tissue.modulus, 0.25);
}

/// Hermite's shape functions of an element of length h at the share t of it: of the displacement and slope
/// at its start, then at its end.
std::array<double, 4> shapes(double t, double h) {
    const double u = 1 - t;
    return {u * u * (1 + 2 * t), h * t * u * u, t * t * (3 - 2 * t), -h * t * t * u};
}

/// Weights of degrees of freedom in a displacement.
struct Place {
    std::array<int, 4> of{};
    std::array<double, 4> weight{};
};

}  // namespace

struct Foundation::Data {
    struct Beam {
        double start = 0, length = 0;  // way along the vessels of its first node; of an element [mm]
        int elements = 0;
        int first = 0;  // degree of freedom of its first node
    };
    CentrelineTree tree;
    std::vector<Tissue> tissues;   // of branches
    std::vector<Beam> beams;       // of branches
    std::vector<Vec3> directions;  // at stations
    std::vector<double> gives;     // at stations [mm/N]
    int size = 0;
    Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver;

    Data(std::span<const CentrelineBranch> branches, std::span<const Tissue> given)
        : tree(branches, {}), tissues(given.begin(), given.end()) {
        if (tissues.size() == 1) tissues.resize(branches.size(), given[0]);
    }
    void look_at_stations();
    void lay(std::span<const CentrelineBranch>);
    void assemble(std::span<const CentrelineBranch>);
    double way_at(int station) const { return tree.way(station, tree.stations()[station].centre).way; }
    Place place(int branch, double way) const;
    Place place(int station, const Vec3& x) const {
        return place(tree.stations()[station].branch, tree.way(station, x).way);
    }
    int modelled(int station) const {
        assert(!tree.stations().empty());
        return std::clamp(station, 0, static_cast<int>(tree.stations().size()) - 1);
    }
};

void Foundation::Data::look_at_stations() {
    const auto stations = tree.stations();
    const int count = static_cast<int>(stations.size());
    for (int i = 0; i < count; ++i) {
        const Station& own = stations[i];
        const auto a_radius_away = [&](int step) {
            int end = i;
            while (end + step >= 0 && end + step < count && stations[end + step].branch == own.branch &&
                   (stations[end].centre - own.centre).norm() <= own.radius)
                end += step;
            return stations[end].centre;
        };
        directions.push_back((a_radius_away(1) - a_radius_away(-1)).normalized());
        const Tissue& tissue = tissues[own.branch];
        const double length = spread(tissue, own.radius);
        gives.push_back(length > 0 ? 1 / (2 * tissue.modulus * length)
                                   : std::numeric_limits<double>::infinity());
    }
}

/// The displacement of a branch at a way. Its first node's displacement is that of the place of its parent,
/// with the slope its own.
Place Foundation::Data::place(int branch, double way) const {
    const Beam& beam = beams[branch];
    const double s = std::clamp((way - beam.start) / beam.length, 0.0, double(beam.elements));
    const int element = std::min(static_cast<int>(s), beam.elements - 1);
    Place p;
    p.weight = shapes(s - element, beam.length);
    for (int k = 0; k < 4; ++k) p.of[k] = beam.first + 2 * element + k;
    return p;
}

void Foundation::Data::lay(std::span<const CentrelineBranch> branches) {
    int first = 0;
    for (std::size_t b = 0; b < branches.size(); ++b) {
        const CentrelineBranch& branch = branches[b];
        const int stations = static_cast<int>(branch.points.size());
        Beam beam;
        beam.first = size;
        beam.start = way_at(first);
        const double length = way_at(first + stations - 1) - beam.start;
        double least = *std::min_element(branch.radii.begin(), branch.radii.end());
        const double wanted = std::clamp(spread(tissues[b], least) / elements_per_length, shortest, longest);
        beam.elements = std::max(1, static_cast<int>(std::ceil(length / wanted)));
        beam.length = length / beam.elements;
        size += 2 * (beam.elements + 1);
        beams.push_back(beam);
        first += stations;
    }
}

void Foundation::Data::assemble(std::span<const CentrelineBranch> branches) {
    std::vector<Eigen::Triplet<double>> entries;
    int first = 0;
    for (std::size_t b = 0; b < branches.size(); ++b) {
        const CentrelineBranch& branch = branches[b];
        const Beam& beam = beams[b];
        const double h = beam.length, k = tissues[b].modulus;
        int sample = 0;
        for (int e = 0; e < beam.elements; ++e) {
            const double middle = beam.start + (e + 0.5) * h;
            while (sample + 1 < static_cast<int>(branch.points.size()) && way_at(first + sample) < middle)
                ++sample;
            const double bending = std::numbers::pi * std::pow(branch.radii[sample], 4) * tissues[b].wall;
            // ∫ k N Nᵀ and ∫ B N″ N″ᵀ over the element.
            const double m = k * h / 420, c = bending / (h * h * h);
            const double mass[4][4] = {{156 * m, 22 * h * m, 54 * m, -13 * h * m},
                                       {22 * h * m, 4 * h * h * m, 13 * h * m, -3 * h * h * m},
                                       {54 * m, 13 * h * m, 156 * m, -22 * h * m},
                                       {-13 * h * m, -3 * h * h * m, -22 * h * m, 4 * h * h * m}};
            const double bend[4][4] = {{12 * c, 6 * h * c, -12 * c, 6 * h * c},
                                       {6 * h * c, 4 * h * h * c, -6 * h * c, 2 * h * h * c},
                                       {-12 * c, -6 * h * c, 12 * c, -6 * h * c},
                                       {6 * h * c, 2 * h * h * c, -6 * h * c, 4 * h * h * c}};
            for (int i = 0; i < 4; ++i)
                for (int j = 0; j < 4; ++j)
                    entries.emplace_back(beam.first + 2 * e + i, beam.first + 2 * e + j,
                                         mass[i][j] + bend[i][j]);
        }
        if (branch.parent >= 0) {
            // A stiff spring between the first node and the place of the parent that carries it.
            const Place parent = place(branch.parent, way_at(first));
            const double reach = std::max(h, spread(tissues[b], branch.radii[0]));
            constexpr double stiffer = 1e4;
            const double tie = stiffer * k * reach;
            std::array<int, 5> of{beam.first};
            std::array<double, 5> weight{1};
            for (int i = 0; i < 4; ++i) of[i + 1] = parent.of[i], weight[i + 1] = -parent.weight[i];
            for (int i = 0; i < 5; ++i)
                for (int j = 0; j < 5; ++j) entries.emplace_back(of[i], of[j], tie * weight[i] * weight[j]);
        }
        first += static_cast<int>(branch.points.size());
    }
    Eigen::SparseMatrix<double> matrix(size, size);
    matrix.setFromTriplets(entries.begin(), entries.end());
    solver.compute(matrix);
    if (solver.info() != Eigen::Success)
        throw std::invalid_argument(
            "expected vessels whose tissue holds them, found a foundation that "
            "cannot be solved");
}

Foundation::Foundation(std::span<const CentrelineBranch> branches, std::span<const Tissue> tissues) {
    if (tissues.size() != 1 && tissues.size() != branches.size())
        throw std::invalid_argument("expected one tissue or one a branch, " +
                                    std::to_string(branches.size()) + ", found " +
                                    std::to_string(tissues.size()));
    for (const Tissue& tissue : tissues)
        if (!(tissue.modulus > 0 && std::isfinite(tissue.modulus) && tissue.wall >= 0 &&
              std::isfinite(tissue.wall)))
            throw std::invalid_argument("a tissue's modulus must be > 0 and its wall >= 0");
    auto data = std::make_unique<Data>(branches, tissues);
    data->look_at_stations();
    data->lay(branches);
    data->assemble(branches);
    data_ = std::move(data);
}

Foundation::~Foundation() = default;

Foundation::Displacement Foundation::displacement(std::span<const Load> loads) const {
    Displacement right = Displacement::Zero(data_->size, 3);
    for (const Load& load : loads) {
        const Place p = data_->place(data_->modelled(load.station), load.place);
        for (int k = 0; k < 4; ++k) right.row(p.of[k]) += p.weight[k] * load.force.transpose();
    }
    if (right.isZero(0)) return right;
    return data_->solver.solve(right);
}

Vec3 Foundation::at(const Displacement& of, int station, const Vec3& x) const {
    assert(of.rows() == data_->size);
    const Place p = data_->place(data_->modelled(station), x);
    Vec3 sum = Vec3::Zero();
    for (int k = 0; k < 4; ++k) sum += p.weight[k] * of.row(p.of[k]).transpose();
    return sum;
}

Vec3 Foundation::along(int station) const {
    return data_->directions[static_cast<std::size_t>(data_->modelled(station))];
}

double Foundation::give(int station) const {
    return data_->gives[static_cast<std::size_t>(data_->modelled(station))];
}

double Foundation::give_of_many(int station, double length) const {
    assert(length > 0);
    const Station& s = data_->tree.stations()[data_->modelled(station)];
    return 1 / (data_->tissues[s.branch].modulus * length);
}

bool Foundation::springs_alone(int station) const {
    return data_->tissues[data_->tree.stations()[data_->modelled(station)].branch].wall == 0;
}

const CentrelineTree& Foundation::tree() const {
    return data_->tree;
}

}  // namespace physics
