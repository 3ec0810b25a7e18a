#include "physics/wall/foundation.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <array>
#include <atomic>
#include <cassert>
#include <cmath>
#include <limits>
#include <mutex>
#include <numbers>
#include <stdexcept>
#include <string>

#include "physics/geometry/maths.h"
#include "physics/wall/past_end.h"

namespace physics {
namespace {

/// Elements a length over which a vessel spreads a force: 3 give the way under a single force to 0.1 %.
constexpr double elements_per_length = 3;
constexpr double shortest = 1, longest = 10;  // of an element [mm]

/// (4B/k_f)^¼: the length over which the vessel's own bending spreads a force [mm].
double spread(const Tissue& tissue, double radius) {
    const double bending = std::numbers::pi * geometry::pow(radius, 4) * tissue.wall;
    return geometry::pow(4 * bending / tissue.modulus, 0.25);
}

/// Hermite's shape functions of an element of length h at the fraction t of it: of the displacement and slope
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
        int first = 0;      // degree of freedom of its first node
        double before = 0;  // of its length, past an open end where the branch starts [mm]
        double after = 0;   // and where it stops
    };
    CentrelineTree tree;
    std::vector<Tissue> tissues;     // of branches
    std::vector<Beam> beams;         // of branches
    std::vector<int> parents;        // of branches
    std::vector<int> first_station;  // of branches, and the number of stations
    std::vector<Vec3> directions;    // at stations
    /// At stations, 0 where nobody has asked yet [mm/N].
    mutable std::vector<std::atomic<double>> gives;
    int size = 0;
    mutable std::once_flag once;
    mutable Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> known_solver;  // by solver()

    Data(std::span<const CentrelineBranch> branches, std::span<const Tissue> given,
         std::span<const OpenEnd> ends)
        : tree(branches, {ends.begin(), ends.end()}), tissues(given.begin(), given.end()) {
        if (tissues.size() == 1) tissues.resize(branches.size(), given[0]);
        for (const CentrelineBranch& branch : branches) parents.push_back(branch.parent);
        gives = std::vector<std::atomic<double>>(tree.stations().size());
    }
    void look_at_stations();
    void lay(std::span<const CentrelineBranch>);
    Eigen::SparseMatrix<double> assembled() const;
    const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>& solver() const;
    double give(int station) const;
    using Entries = std::vector<Eigen::Triplet<double>>;
    static void tie(const Place&, const Place&, double stiffness, Entries&);
    void tie_where_one(int branch, int other, Entries&) const;
    double arc_at(int station) const { return tree.coordinate(station, tree.stations()[station].centre).arc; }
    Place place(int branch, double arc) const;
    Place place(int station, const Vec3& x) const {
        const int branch = tree.stations()[station].branch;
        return place(branch, tree.coordinate(station, x).arc + past_ends(branch, x));
    }
    double past_ends(int branch, const Vec3& x) const;
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
    }
}

/// The displacement of a branch at a way. Its first node's displacement is that of the place of its parent,
/// with the slope its own.
Place Foundation::Data::place(int branch, double arc) const {
    const Beam& beam = beams[branch];
    const double s = std::clamp((arc - beam.start) / beam.length, 0.0, double(beam.elements));
    const int element = std::min(static_cast<int>(s), beam.elements - 1);
    Place p;
    p.weight = shapes(s - element, beam.length);
    for (int k = 0; k < 4; ++k) p.of[k] = beam.first + 2 * element + k;
    return p;
}

/// How far the vessel goes on past an open end, as PastEnd has it; a sheath is no vessel [mm].
double goes_on(const OpenEnd& end) {
    if (end.goes_on == Continuation::Sheath) return 0;
    return std::min(end.length, PastEnd::narrows_over * end.radius);
}

/// Way past the first (< 0) or last station of a branch of a place there [mm].
double Foundation::Data::past_ends(int branch, const Vec3& x) const {
    const Beam& beam = beams[branch];
    const auto stations = tree.stations();
    const int first = first_station[branch], last = first_station[branch + 1] - 1;
    if (beam.after > 0)
        if (const double past = (x - stations[last].centre).dot(directions[last]); past > 0)
            return std::min(past, beam.after);
    if (beam.before > 0)
        if (const double past = (stations[first].centre - x).dot(directions[first]); past > 0)
            return -std::min(past, beam.before);
    return 0;
}

void Foundation::Data::lay(std::span<const CentrelineBranch> branches) {
    int first = 0;
    for (std::size_t b = 0; b < branches.size(); ++b) {
        const CentrelineBranch& branch = branches[b];
        const int stations = static_cast<int>(branch.points.size());
        Beam beam;
        beam.first = size;
        for (const OpenEnd& end : tree.ends()) {
            const int at = tree.locate(end.centre, -1);
            if (at < first || at >= first + stations) continue;
            (at - first < stations / 2 ? beam.before : beam.after) = goes_on(end);
        }
        beam.start = arc_at(first) - beam.before;
        const double length = arc_at(first + stations - 1) - arc_at(first) + beam.before + beam.after;
        double least = *std::min_element(branch.radii.begin(), branch.radii.end());
        const double wanted = std::clamp(spread(tissues[b], least) / elements_per_length, shortest, longest);
        beam.elements = std::max(1, static_cast<int>(std::ceil(length / wanted)));
        beam.length = length / beam.elements;
        size += 2 * (beam.elements + 1);
        beams.push_back(beam);
        first_station.push_back(first);
        first += stations;
    }
    first_station.push_back(first);
}

/// A spring between two places.
void Foundation::Data::tie(const Place& a, const Place& b, double stiffness, Entries& entries) {
    std::array<int, 8> of{};
    std::array<double, 8> weight{};
    for (int i = 0; i < 4; ++i) {
        of[i] = a.of[i], weight[i] = a.weight[i];
        of[i + 4] = b.of[i], weight[i + 4] = -b.weight[i];
    }
    for (int i = 0; i < 8; ++i)
        for (int j = 0; j < 8; ++j) entries.emplace_back(of[i], of[j], stiffness * weight[i] * weight[j]);
}

/// From the start of a branch on, as far as its lumen overlaps another's, both share a wall: as wide as the
/// overlap w, two walls thick and of Young's modulus E, which holds them together by E w/2h per length. With
/// `wall` = E h/R that is wall (R/h)² w/2R.
void Foundation::Data::tie_where_one(int branch, int other, Entries& entries) const {
    constexpr double thickness = 0.1;  // h/R of an artery (estimate; 0.06 to 0.16)
    const auto stations = tree.stations();
    const int start = first_station[branch], end = first_station[branch + 1];
    for (int s = start; s < end; ++s) {
        const Station& own = stations[s];
        int nearest = first_station[other];
        for (int t = nearest; t < first_station[other + 1]; ++t)
            if ((stations[t].centre - own.centre).squaredNorm() <
                (stations[nearest].centre - own.centre).squaredNorm())
                nearest = t;
        const double overlap =
            own.radius + stations[nearest].radius - (stations[nearest].centre - own.centre).norm();
        if (overlap <= 0) return;
        const double width = std::min(overlap, 2 * own.radius),
                     length = arc_at(std::min(s + 1, end - 1)) - arc_at(std::max(s - 1, start));
        const double modulus = tissues[branch].wall / (thickness * thickness) * width / (2 * own.radius);
        tie(place(branch, arc_at(s)), place(nearest, own.centre), 0.5 * length * modulus, entries);
    }
}

Eigen::SparseMatrix<double> Foundation::Data::assembled() const {
    Entries entries;
    const int count = static_cast<int>(beams.size());
    for (int b = 0; b < count; ++b) {
        const int first = first_station[b];
        const auto stations = tree.stations().subspan(first, first_station[b + 1] - first);
        const Beam& beam = beams[b];
        const double h = beam.length, k = tissues[b].modulus;
        int sample = 0;
        for (int e = 0; e < beam.elements; ++e) {
            const double middle = beam.start + (e + 0.5) * h;
            while (sample + 1 < static_cast<int>(stations.size()) && arc_at(first + sample) < middle)
                ++sample;
            const double bending =
                std::numbers::pi * geometry::pow(stations[sample].radius, 4) * tissues[b].wall;
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
        if (parents[b] >= 0) {
            constexpr double stiffer = 1e4;
            const double reach = std::max(h, spread(tissues[b], stations[0].radius));
            tie(place(b, arc_at(first)), place(parents[b], arc_at(first)), stiffer * k * reach, entries);
        }
    }
    for (int b = 0; b < count; ++b) {
        const int parent = parents[b];
        if (parent < 0) continue;
        tie_where_one(b, parent, entries);
        for (int sibling = 0; sibling < b; ++sibling)
            if (parents[sibling] == parent) tie_where_one(b, sibling, entries);
    }
    Eigen::SparseMatrix<double> matrix(size, size);
    matrix.setFromTriplets(entries.begin(), entries.end());
    return matrix;
}

/// Made when vessels first move: where they stay, nobody needs it.
const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>& Foundation::Data::solver() const {
    std::call_once(once, [&] {
        known_solver.compute(assembled());
        if (known_solver.info() != Eigen::Success)
            throw std::invalid_argument(
                "expected vessels whose tissue holds them, found a foundation that "
                "cannot be solved");
    });
    return known_solver;
}

/// What a force at a station moves the vessel there by, with all that is joined to it.
double Foundation::Data::give(int station) const {
    if (tissues[tree.stations()[station].branch].wall == 0) return std::numeric_limits<double>::infinity();
    std::atomic<double>& known = gives[static_cast<std::size_t>(station)];
    double give = known.load(std::memory_order_relaxed);
    if (give != 0) return give;
    Eigen::VectorXd right = Eigen::VectorXd::Zero(size);
    const Place p = place(station, tree.stations()[station].centre);
    for (int k = 0; k < 4; ++k) right[p.of[k]] = p.weight[k];
    const Eigen::VectorXd moved = solver().solve(right);
    for (int k = 0; k < 4; ++k) give += p.weight[k] * moved[p.of[k]];
    known.store(give, std::memory_order_relaxed);
    return give;
}

Foundation::Foundation(std::span<const CentrelineBranch> branches, std::span<const Tissue> tissues,
                       std::span<const OpenEnd> ends) {
    if (tissues.size() != 1 && tissues.size() != branches.size())
        throw std::invalid_argument("expected one tissue or one a branch, " +
                                    std::to_string(branches.size()) + ", found " +
                                    std::to_string(tissues.size()));
    for (const Tissue& tissue : tissues)
        if (!(tissue.modulus > 0 && std::isfinite(tissue.modulus) && tissue.wall >= 0 &&
              std::isfinite(tissue.wall)))
            throw std::invalid_argument("a tissue's modulus must be > 0 and its wall >= 0");
    auto data = std::make_unique<Data>(branches, tissues, ends);
    data->look_at_stations();
    data->lay(branches);
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
    return data_->solver().solve(right);
}

Vec3 Foundation::at(const Displacement& of, int station, const Vec3& x) const {
    assert(of.rows() == data_->size);
    const Place p = data_->place(data_->modelled(station), x);
    Vec3 sum = Vec3::Zero();
    for (int k = 0; k < 4; ++k) sum += p.weight[k] * of.row(p.of[k]).transpose();
    return sum;
}

const Station& Foundation::station(int station) const {
    return data_->tree.stations()[static_cast<std::size_t>(data_->modelled(station))];
}

Vec3 Foundation::along(int station) const {
    return data_->directions[static_cast<std::size_t>(data_->modelled(station))];
}

double Foundation::give(int station) const {
    return data_->give(data_->modelled(station));
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
