#include "engine/exercise/venous_trees.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "engine/exercise/vessel_growth.h"
#include "physics/geometry/maths.h"
#include "physics/geometry/mesh_query.h"

namespace exercise {
namespace {

using geometry::Vec3;

constexpr std::uint32_t vein_bins = blood::DistalArteries::bins;
constexpr double smallest_vein = 0.2;      // of a tree's veins [mm]
constexpr double smallest_cortical = 0.4;  // of those over the brain that reach a sinus [mm]

/// The veins that mix, by organ: their flow with the blood that comes from elsewhere [ml/s], as the other
/// half of the brain's (estimates).
struct Mixing {
    std::string_view organ;
    double flow;
};
constexpr std::array<Mixing, 4> mixings = {{{"brain", 11}, {"gut", 16}, {"heart", 8}, {"kidney", 36}}};

std::string last_part(const std::string& branch) {
    return branch.substr(branch.rfind('+') + 1);
}

bool has_veins(const blood::Outlet& outlet) {
    // The liver's blood leaves it below the diaphragm, straight into the vena cava.
    return outlet.venous > 0 && outlet.radius < trunk_radius && last_part(outlet.branch) != "CHA";
}

struct Station {
    Vec3 place;
    double radius;
    double fill = 1;
};

/// Nodes along a vein: those of the bins between two, the first at its beginning.
struct Bins {
    std::uint32_t node;
    double from, to;
    std::uint32_t at(double part) const {
        const double bin = from + part * (to - from);
        return node + static_cast<std::uint32_t>(std::clamp(bin, 0.0, vein_bins - 1.0));
    }
};

/// A smooth tube through the stations.
void add_tube(const std::vector<Station>& stations, const Bins& nodes,
              std::vector<render::VesselPiece>& pieces) {
    constexpr double step = 2;  // [mm]
    if (stations.size() < 2) return;
    std::vector<Station> fine;
    const auto of = [&](std::ptrdiff_t k) -> const Station& {
        return stations[static_cast<std::size_t>(
            std::clamp<std::ptrdiff_t>(k, 0, static_cast<std::ptrdiff_t>(stations.size()) - 1))];
    };
    for (std::ptrdiff_t k = 0; k + 1 < static_cast<std::ptrdiff_t>(stations.size()); ++k) {
        const Station &a = of(k - 1), &b = of(k), &c = of(k + 1), &d = of(k + 2);
        const int count = std::max(1, static_cast<int>(std::ceil((c.place - b.place).norm() / step)));
        for (int i = 0; i < count; ++i) {
            const double t = static_cast<double>(i) / count, t2 = t * t, t3 = t2 * t;
            const Vec3 p = 0.5 * (2 * b.place + t * (c.place - a.place) +
                                  t2 * (2 * a.place - 5 * b.place + 4 * c.place - d.place) +
                                  t3 * (3 * b.place - a.place - 3 * c.place + d.place));
            fine.push_back({p, b.radius + t * (c.radius - b.radius), b.fill + t * (c.fill - b.fill)});
        }
    }
    fine.push_back(stations.back());
    const std::size_t first = pieces.size();
    for (std::size_t k = 0; k + 1 < fine.size(); ++k) {
        const Vec3 way = fine[k + 1].place - fine[k].place;
        if (!(way.norm() > 1e-3)) continue;
        const Vec3 ahead = way.normalized();
        const bool joins = pieces.size() > first;
        const Vec3 begins = joins ? joined(pieces.back(), ahead) : ahead;
        pieces.push_back({fine[k].place, fine[k + 1].place,
                          static_cast<float>(0.5 * (fine[k].radius + fine[k + 1].radius)),
                          static_cast<float>(0.5 * (fine[k].fill + fine[k + 1].fill)),
                          nodes.at(static_cast<double>(k) / static_cast<double>(fine.size())), begins,
                          ahead});
    }
}

/// The last part fades.
void fade(std::vector<Station>& stations, double part) {
    const double first = (1 - part) * static_cast<double>(stations.size());
    for (std::size_t k = 0; k < stations.size(); ++k) {
        const double past = (static_cast<double>(k) - first) / (part * static_cast<double>(stations.size()));
        stations[k].fill = 0.5 + 0.5 * geometry::cos(std::numbers::pi * std::clamp(past, 0.0, 1.0));
    }
}

/// Up the artery from an outlet, every few mm, smoothed.
std::vector<Station> up_artery(const blood::BloodFlow& blood, int cell, double widest) {
    std::vector<Station> raw;
    for (; cell >= 0; cell = blood.cells[static_cast<std::size_t>(cell)].upstream) {
        const blood::FlowCell& at = blood.cells[static_cast<std::size_t>(cell)];
        if (at.radius > widest) break;
        raw.push_back({at.centre, at.radius});
    }
    constexpr std::ptrdiff_t reach = 6, every = 4;
    std::vector<Station> smooth;
    const auto count = static_cast<std::ptrdiff_t>(raw.size());
    for (std::ptrdiff_t k = 0; k < count; k += every) {
        const std::ptrdiff_t near = std::min({reach, k, count - 1 - k});
        Station mean{Vec3::Zero(), 0};
        for (std::ptrdiff_t i = k - near; i <= k + near; ++i) {
            mean.place += raw[static_cast<std::size_t>(i)].place;
            mean.radius += raw[static_cast<std::size_t>(i)].radius;
        }
        smooth.push_back({mean.place / static_cast<double>(2 * near + 1),
                          mean.radius / static_cast<double>(2 * near + 1)});
    }
    return smooth;
}

class Veins {
public:
    Veins(const anatomy::Anatomy& anatomy, const blood::BloodFlow& blood,
          const std::vector<render::TissueLayer>& layers, const std::vector<std::vector<Vec3>>& tissue,
          std::uint32_t first, std::vector<render::VesselPiece>& pieces)
        : anatomy_(anatomy),
          blood_(blood),
          layers_(layers),
          tissue_(tissue),
          first_(first),
          pieces_(pieces),
          collecting_(collecting_veins(blood)) {}

    void add() {
        for (std::size_t k = 0; k < blood_.outlets.size(); ++k) {
            const blood::Outlet& outlet = blood_.outlets[k];
            if (!has_veins(outlet) || tissue_[k].empty()) continue;
            if (outlet.organ == "brain" && brain()) continue;
            if (outlet.organ == "kidney")
                of_kidney(k);
            else if (outlet.organ == "gut")
                of_gut(k);
            else
                beside_artery(k);
        }
        of_brain();
        of_heart();
    }

private:
    std::uint32_t own(std::size_t outlet) const {
        return first_ + static_cast<std::uint32_t>(outlet) * vein_bins;
    }
    /// Of the veins that collect an outlet's blood; −1 for none.
    int collecting(std::size_t outlet) const {
        for (std::size_t c = 0; c < collecting_.size(); ++c)
            if (std::ranges::find(collecting_[c].outlets, static_cast<int>(outlet)) !=
                collecting_[c].outlets.end())
                return static_cast<int>(c);
        return -1;
    }
    std::uint32_t node_of(int collecting) const {
        return first_ +
               (static_cast<std::uint32_t>(blood_.outlets.size()) + static_cast<std::uint32_t>(collecting)) *
                   vein_bins;
    }
    const geometry::TriangleMesh* brain() const {
        for (const render::TissueLayer& layer : layers_)
            if (layer.name == "brain") return &layer.mesh;
        return nullptr;
    }
    void tree(std::size_t outlet, std::vector<Vec3> points, const Vec3& place, const Vec3& direction,
              double radius, std::uint32_t until) {
        constexpr std::size_t most = 260;
        if (points.size() > most) points.resize(most);
        grow_into(std::move(points),
                  {place, direction, radius, smallest_vein, 0.3, seed_of(blood_.outlets[outlet].end) + 2},
                  {own(outlet), std::max(1u, until), true}, pieces_);
    }

    /// The aorta where an artery leaves it, and how wide it is there.
    Station origin(int cell) const {
        while (blood_.cells[static_cast<std::size_t>(cell)].upstream >= 0 &&
               blood_.cells[static_cast<std::size_t>(cell)].radius < 6.5)
            cell = blood_.cells[static_cast<std::size_t>(cell)].upstream;
        const blood::FlowCell& at = blood_.cells[static_cast<std::size_t>(cell)];
        return {at.centre, at.radius};
    }

    void of_kidney(std::size_t k) {
        const blood::Outlet& outlet = blood_.outlets[k];
        const double radius = 1.5 * outlet.radius;
        const Vec3 aside(0, -outlet.radius - radius - 1, -2);  // in front of the artery
        const Vec3 place = outlet.place + aside;
        tree(k, tissue_[k], place, outlet.direction, radius, vein_bins / 2);
        const Station aorta = origin(outlet.cell);
        const double cava = 10;  // radius [mm]
        const Vec3 end = aorta.place + Vec3(-aorta.radius - cava - 2, -3, 0);
        std::vector<Station> way = up_artery(blood_, outlet.cell, 6.5);
        std::vector<Station> vein{{place, radius}};
        const bool left = outlet.place.x() > aorta.place.x();
        for (const Station& artery : way) {
            const double near =
                left ? artery.place.x() - aorta.place.x() - aorta.radius - 8 : end.x() - 4 - artery.place.x();
            if (near < 0) break;
            if ((artery.place - outlet.place).norm() > 4) vein.push_back({artery.place + aside, radius});
        }
        // The left one crosses in front of the aorta.
        if (left) vein.push_back({aorta.place + Vec3(2, -aorta.radius - radius - 2, 4), radius});
        vein.push_back({end + Vec3(left ? 4 : -3, 0, 6), radius});
        add_tube(vein, {own(k), vein_bins / 2.0, vein_bins - 4.0}, pieces_);
        // Up the vena cava.
        std::vector<Station> up;
        for (int i = 0; i <= 12; ++i) up.push_back({end + Vec3(-0.4 * i, -0.3 * i, 4 + 8.0 * i), cava});
        fade(up, 0.5);
        if (const int c = collecting(k); c >= 0) {
            const auto& outlets = collecting_[static_cast<std::size_t>(c)].outlets;
            if (outlets.front() == static_cast<int>(k))
                add_tube(up, {node_of(c), vein_bins - 4.0, vein_bins - 1.0}, pieces_);
        }
    }

    void of_gut(std::size_t k) {
        const blood::Outlet& outlet = blood_.outlets[k];
        const double radius = 1.35 * outlet.radius;
        const bool splenic = last_part(outlet.branch) == "splenic";
        const Vec3 aside =
            splenic ? Vec3(0, -2, -outlet.radius - radius - 2) : Vec3(-outlet.radius - radius - 3, -1, 0);
        tree(k, tissue_[k], outlet.place + aside, outlet.direction, radius, vein_bins / 2);
        const Station aorta = origin(outlet.cell);
        const Vec3 confluence(aorta.place.x() - 14, aorta.place.y() - aorta.radius - 18, portal_height());
        std::vector<Station> vein;
        for (const Station& artery : up_artery(blood_, outlet.cell, 6.5)) {
            if ((artery.place - aorta.place).norm() < aorta.radius + 12) break;
            if (!splenic && artery.place.z() > confluence.z() - 8) break;
            vein.push_back({artery.place + aside, radius});
        }
        if (vein.size() < 2) return;
        vein.push_back({confluence, 1.2 * radius});
        add_tube(vein, {own(k), vein_bins / 2.0, vein_bins - 6.0}, pieces_);
        const int c = collecting(k);
        if (c < 0 || collecting_[static_cast<std::size_t>(c)].outlets.front() != static_cast<int>(k)) return;
        // The portal vein, and its branches into the liver.
        const Vec3 hilum = confluence + Vec3(-38, -2, 38);
        add_tube({{confluence + Vec3(3, 0, -4), 6}, {confluence + Vec3(-16, -1, 18), 6}, {hilum, 5.5}},
                 {node_of(c), vein_bins - 6.0, vein_bins - 3.0}, pieces_);
        for (const Vec3& to : {Vec3(-40, 8, 22), Vec3(22, -26, 26)}) {
            std::vector<Station> branch;
            for (int i = 0; i <= 8; ++i)
                branch.push_back(
                    {hilum + i / 8.0 * to + Vec3(0, 0, 6 * geometry::sin(i / 8.0 * std::numbers::pi)),
                     4.0 - 0.3 * i});
            fade(branch, 0.6);
            add_tube(branch, {node_of(c), vein_bins - 3.0, vein_bins - 1.0}, pieces_);
        }
    }
    /// Of the portal vein's beginning: where the superior mesenteric artery leaves the aorta.
    double portal_height() const {
        double height = 0;
        for (const blood::Outlet& outlet : blood_.outlets)
            if (last_part(outlet.branch) == "SMA" || outlet.branch == "coeliac")
                height = origin(outlet.cell).place.z();
        return height;
    }

    void beside_artery(std::size_t k) {
        const blood::Outlet& outlet = blood_.outlets[k];
        const bool heart = outlet.organ == "heart";
        const double wider = heart ? 0.9 : 1.25, radius = wider * outlet.radius;
        const double apart = outlet.radius + radius + (heart ? 0.3 : 1.0);
        const Vec3 aside = apart * Vec3(outlet.place.x() > 0 ? -0.8 : 0.8, 0.6, 0).normalized();
        tree(k, tissue_[k], outlet.place + aside, outlet.direction, radius, heart ? 8 : vein_bins / 2);
        std::vector<Station> vein = up_artery(blood_, outlet.cell, heart ? 3.5 : 6.5);
        if (heart) {
            // Into the next one, and that of the anterior descending artery on beside the circumflex.
            const int branch = blood_.cells[static_cast<std::size_t>(outlet.cell)].branch;
            const auto circumflex = circumflex_artery();
            const auto ends = std::ranges::find_if(vein, [&](const Station& at) {
                return blood_.cells[static_cast<std::size_t>(blood_.nearest(at.place))].branch != branch ||
                       (circumflex && (at.place - circumflex->front().place).norm() < 4);
            });
            vein.erase(ends, vein.end());
        } else {
            fade(vein, 0.3);
        }
        for (Station& station : vein) {
            station.place += aside * std::max(1.0, station.radius / outlet.radius);
            station.radius = heart ? std::min(wider * station.radius, 1.4) : wider * station.radius;
        }
        add_tube(vein, {own(k), heart ? 8.0 : vein_bins / 2.0, heart ? 13.0 : vein_bins - 1.0}, pieces_);
    }

    /// From its origin.
    std::optional<std::vector<Station>> circumflex_artery() const {
        const auto outlet = std::ranges::find_if(
            blood_.outlets, [](const blood::Outlet& at) { return last_part(at.branch) == "LCX"; });
        if (outlet == blood_.outlets.end()) return std::nullopt;
        std::vector<Station> way = up_artery(blood_, outlet->cell, 3.5);
        const int branch = blood_.cells[static_cast<std::size_t>(outlet->cell)].branch;
        std::erase_if(way, [&](const Station& at) {
            return blood_.cells[static_cast<std::size_t>(blood_.nearest(at.place))].branch != branch;
        });
        if (way.size() < 3) return std::nullopt;
        std::ranges::reverse(way);
        return way;
    }

    /// The great cardiac vein goes over into the coronary sinus in the groove beside the circumflex artery.
    void of_heart() {
        const auto artery = circumflex_artery();
        int c = -1;
        for (std::size_t k = 0; k < blood_.outlets.size() && c < 0; ++k)
            if (blood_.outlets[k].organ == "heart") c = collecting(k);
        if (!artery || c < 0) return;
        std::vector<Station> vein = *artery;
        for (std::size_t k = 0; k < vein.size(); ++k) {
            vein[k].place += Vec3(-0.5, 1.5, 2.6);
            vein[k].radius = 1.2 + 1.2 * static_cast<double>(k) / static_cast<double>(vein.size());
        }
        Vec3 at = vein.back().place, ahead = (at - vein[vein.size() - 2].place).normalized();
        for (int i = 0; i < 7; ++i) {
            ahead = (ahead + 0.22 * Vec3(-1, 0.1, 0.1)).normalized();
            at += 4 * ahead;
            vein.push_back({at, 2.5 + 0.1 * i});
        }
        fade(vein, 0.3);
        add_tube(vein, {node_of(c), 12, vein_bins - 1.0}, pieces_);
    }

    void of_brain();

    const anatomy::Anatomy& anatomy_;
    const blood::BloodFlow& blood_;
    const std::vector<render::TissueLayer>& layers_;
    const std::vector<std::vector<Vec3>>& tissue_;
    std::uint32_t first_;
    std::vector<render::VesselPiece>& pieces_;
    std::vector<CollectingVein> collecting_;
};

/// Sagittal sinus from the front over the top to the back of the head, transverse and sigmoid sinuses,
/// jugular veins, straight sinus with the internal cerebral vein; and cortical veins that run over the
/// surface to them.
void Veins::of_brain() {
    const geometry::TriangleMesh* mesh = brain();
    std::vector<std::size_t> supplied;
    for (std::size_t k = 0; k < blood_.outlets.size(); ++k)
        if (blood_.outlets[k].organ == "brain" && has_veins(blood_.outlets[k]) && !tissue_[k].empty())
            supplied.push_back(k);
    if (!mesh || supplied.empty()) return;
    const int c = collecting(supplied.front());
    if (c < 0) return;
    Eigen::AlignedBox3d box;
    for (const Vec3& v : mesh->vertices) box.extend(v);
    const geometry::MeshQuery query(*mesh);
    const Vec3 middle(box.center().x(), box.center().y(), box.min().z() + 0.45 * box.sizes().z());
    const auto surface = [&](const Vec3& direction, double outside) {
        const double away = query.first_hit(middle, direction);
        return Vec3(middle + (std::isfinite(away) ? away + outside : 60.0) * direction);
    };
    const std::uint32_t node = node_of(c);
    constexpr double degree = std::numbers::pi / 180;
    // From the forehead, by the angle from there.
    std::vector<Station> sagittal;
    for (double angle = 8; angle <= 196; angle += 6) {
        const double part = (angle - 8) / 188;
        sagittal.push_back(
            {surface(Vec3(0, -geometry::cos(angle * degree), geometry::sin(angle * degree)), 2.5),
             0.7 + 2.6 * part, std::min(1.0, 4 * part + 0.2)});
    }
    constexpr double from_sagittal = 7, from_torcula = 15, from_sigmoid = 19;
    add_tube(sagittal, {node, from_sagittal, from_torcula}, pieces_);
    const Vec3 torcula = sagittal.back().place;
    struct Entry {
        Vec3 place, direction;
        double radius, bin;
    };
    std::vector<Entry> entries;
    for (const double side : {1.0, -1.0}) {
        // Most people's right one is the wider.
        const double wide = side > 0 ? 2.6 : 3.4;
        std::vector<Station> transverse{{torcula, wide}};
        const double sink =
            geometry::asin(std::clamp((torcula.z() - middle.z()) / (torcula - middle).norm(), -1.0, 1.0));
        for (double angle = 14; angle <= 92; angle += 8)
            transverse.push_back(
                {surface(Vec3(side * geometry::sin(angle * degree), geometry::cos(angle * degree),
                              geometry::tan(sink) + 0.06 * geometry::sin(2 * angle * degree))
                             .normalized(),
                         0.5),
                 wide});
        entries.push_back({transverse[6].place, Vec3(0, -0.9, 0.5).normalized(), 1.3, 17});  // Labbé
        add_tube(transverse, {node, from_torcula, from_sigmoid}, pieces_);
        const Vec3 bend = transverse.back().place, ahead = (bend - transverse[transverse.size() - 2].place);
        const Vec3 foramen = Vec3(middle.x() + side * 24, bend.y() + 2, box.min().z() + 4);
        std::vector<Station> sigmoid{{bend, wide},
                                     {bend + ahead + Vec3(-side * 4, 0, -8), wide},
                                     {0.5 * (bend + foramen) + Vec3(side * 2, 4, -6), wide},
                                     {foramen, wide + 0.4}};
        for (int i = 1; i <= 8; ++i)
            sigmoid.push_back({foramen + Vec3(side * 1.0 * i, -0.9 * i, -12.0 * i), wide + 0.4 + 0.15 * i});
        add_tube(sigmoid, {node, from_sigmoid, vein_bins - 1.0}, pieces_);
    }
    // Deep veins.
    const Vec3 sella = anatomy_.body && anatomy_.body->landmark == geometry::Landmark::Sella
                           ? anatomy_.body->at
                           : Vec3(middle.x(), middle.y() - 18, box.min().z() + 45);
    const Vec3 galen = sella + Vec3(0, 46, 30);
    for (const double side : {1.0, -1.0})
        add_tube({{sella + Vec3(side * 14, -8, 34), 0.5},
                  {sella + Vec3(side * 4, 2, 28), 0.8},
                  {sella + Vec3(side * 2, 22, 32), 1.0},
                  {galen + Vec3(0, -4, 2), 1.3},
                  {galen, 1.8}},
                 {node, 8, 12}, pieces_);
    add_tube({{galen, 1.8},
              {galen + Vec3(0, 8, 4), 2.0},
              {0.5 * (galen + torcula) + Vec3(0, 0, 1), 2.0},
              {torcula, 2.2}},
             {node, 12, from_torcula}, pieces_);
    for (const double part : {0.12, 0.22, 0.33, 0.43, 0.52, 0.62, 0.73, 0.85})
        for (const double side : {1.0, -1.0}) {
            const Station& at =
                sagittal[static_cast<std::size_t>(part * static_cast<double>(sagittal.size()))];
            const Vec3 outward = (at.place - middle).normalized();
            // They enter against the stream, from the front below.
            const Vec3 along = Vec3(0, outward.z(), -outward.y());
            entries.push_back({at.place, (side * Vec3::UnitX() - 0.5 * outward - 0.6 * along).normalized(),
                               0.8 + 0.5 * geometry::sin(std::numbers::pi * part),
                               from_sagittal + part * (from_torcula - from_sagittal)});
        }
    // Tissue near the surface goes to the nearest entry of its side, rather one above: of the blood of
    // several outlets the tree has that of the one with most.
    struct Part {
        Vec3 place;
        std::size_t outlet;
    };
    std::vector<std::vector<Part>> parts(entries.size());
    for (const std::size_t k : supplied)
        for (const Vec3& p : tissue_[k]) {
            const Vec3 on = surface((p - middle).normalized(), -1);
            if ((on - p).norm() > 30) continue;
            std::size_t best = 0;
            double least = std::numeric_limits<double>::infinity();
            for (std::size_t e = 0; e < entries.size(); ++e) {
                const Vec3& entry = entries[e].place;
                const bool above = std::abs(entry.x() - middle.x()) < 10;
                const double side = above ? entries[e].direction.x() : entry.x() - middle.x();
                const double away = (on - entry).norm() * (above ? 1 : 1.6);
                if (side * (p.x() - middle.x()) > 0 && away < least) least = away, best = e;
            }
            if (std::isfinite(least)) parts[best].push_back({on, k});
        }
    for (std::size_t e = 0; e < entries.size(); ++e) {
        constexpr std::size_t fewest = 4, most = 26;  // terminals
        if (parts[e].size() < fewest) continue;
        std::vector<std::size_t> shares(blood_.outlets.size(), 0);
        for (const Part& part : parts[e]) ++shares[part.outlet];
        const auto outlet = static_cast<std::size_t>(std::ranges::max_element(shares) - shares.begin());
        std::vector<Vec3> points;
        const std::size_t every = std::max<std::size_t>(1, parts[e].size() / most);
        for (std::size_t i = 0; i < parts[e].size(); i += every) points.push_back(parts[e][i].place);
        const std::size_t from = pieces_.size();
        Root root{entries[e].place,
                  entries[e].direction,
                  entries[e].radius,
                  smallest_cortical,
                  0.35,
                  seed_of(blood_.outlets[outlet].end) + 2 + 31 * e};
        root.least_part = 0.12, root.largest_part = 0.35;
        grow_into(std::move(points), root, {own(outlet), static_cast<std::uint32_t>(entries[e].bin), true},
                  pieces_);
        const auto drape = [&](const Vec3& p) {
            const Vec3 off = p - middle;
            const double near = std::clamp((p - entries[e].place).norm() / 10, 0.0, 1.0);
            return Vec3((1 - near) * p + near * surface(off.normalized(), -1.5));
        };
        for (std::size_t i = from; i < pieces_.size(); ++i) {
            render::VesselPiece& piece = pieces_[i];
            piece = {drape(piece.from.cast<double>()), drape(piece.to.cast<double>()), piece.radius,
                     piece.fill, piece.node};
        }
    }
}

}  // namespace

std::vector<CollectingVein> collecting_veins(const blood::BloodFlow& blood) {
    std::vector<CollectingVein> all;
    for (const Mixing& mixing : mixings) {
        CollectingVein vein;
        double flow = 0;
        for (std::size_t k = 0; k < blood.outlets.size(); ++k) {
            if (blood.outlets[k].organ != mixing.organ || !has_veins(blood.outlets[k])) continue;
            vein.outlets.push_back(static_cast<int>(k));
            flow += blood.outlets[k].flow;
        }
        if (vein.outlets.empty()) continue;
        for (const int k : vein.outlets)
            vein.fractions.push_back(blood.outlets[static_cast<std::size_t>(k)].flow /
                                     std::max({flow, mixing.flow, 1e-9}));
        all.push_back(std::move(vein));
    }
    return all;
}

std::uint32_t venous_nodes(const blood::BloodFlow& blood) {
    return static_cast<std::uint32_t>(blood.outlets.size() + collecting_veins(blood).size()) * vein_bins;
}

void add_venous_iodine(const blood::ContrastFlow& contrast, std::vector<float>& iodine) {
    const std::span<const float> own = contrast.venous_iodine();
    iodine.insert(iodine.end(), own.begin(), own.end());
    for (const CollectingVein& vein : collecting_veins(contrast.blood()))
        for (std::size_t bin = 0; bin < vein_bins; ++bin) {
            double sum = 0;
            for (std::size_t k = 0; k < vein.outlets.size(); ++k)
                sum += vein.fractions[k] * own[static_cast<std::size_t>(vein.outlets[k]) * vein_bins + bin];
            iodine.push_back(static_cast<float>(sum));
        }
}

void add_veins(const anatomy::Anatomy& anatomy, const blood::BloodFlow& blood,
               const std::vector<render::TissueLayer>& layers, const std::vector<std::vector<Vec3>>& tissue,
               std::uint32_t first, std::vector<render::VesselPiece>& pieces) {
    Veins(anatomy, blood, layers, tissue, first, pieces).add();
}

}  // namespace exercise
