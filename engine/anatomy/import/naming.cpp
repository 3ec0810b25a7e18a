#include "engine/anatomy/import/naming.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <set>

#include "engine/io/error.h"
#include "engine/io/text.h"
#include "physics/geometry/maths.h"

namespace anatomy {
namespace {

using geometry::Mat3;

constexpr std::size_t longest_name = 60;
constexpr double farthest_end = 3;  // from the place that names it [radii]
/// A line runs along a branch when so many of its samples have it within so many radii.
constexpr double least_fraction = 0.5, near_radii = 0.7;

bool may_stand_in_a_name(char c) {
    return static_cast<unsigned char>(c) >= 0x20 && c != '\x7f' && c != '"' && c != '\\';
}

double distance_to(const Polyline& line, const Vec3& x) {
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t i = 1; i < line.size(); ++i) {
        const Vec3 along = line[i] - line[i - 1];
        const double t = std::clamp((x - line[i - 1]).dot(along) / along.squaredNorm(), 0.0, 1.0);
        least = std::min(least, (line[i - 1] + t * along - x).squaredNorm());
    }
    return std::sqrt(least);
}

/// A name as files may hold it: without what may not stand in one, and not too long.
std::string usable(std::string name) {
    std::erase_if(name, [](char c) { return !may_stand_in_a_name(c); });
    name = io::as_utf8(name).substr(0, longest_name);
    while (!io::is_utf8(name)) name.pop_back();  // a character that was cut
    return name;
}

/// All lines of one name.
struct NamedLines {
    std::string name, given;  // usable, and as the file has it
    std::vector<const GivenLine*> lines;
    bool used = false;

    double distance_to(const Vec3& x) const {
        double least = std::numeric_limits<double>::infinity();
        for (const GivenLine* line : lines) least = std::min(least, anatomy::distance_to(line->points, x));
        return least;
    }
    double gap_to_end(const Vec3& x) const {
        double least = std::numeric_limits<double>::infinity();
        for (const GivenLine* line : lines)
            least = std::min({least, (line->points.front() - x).norm(), (line->points.back() - x).norm()});
        return least;
    }
};

std::vector<NamedLines> by_name(std::span<const GivenLine> lines) {
    std::vector<NamedLines> all;
    for (const GivenLine& line : lines) {
        const std::string name = usable(line.name);
        if (name.empty()) continue;
        auto found = std::ranges::find(all, line.name, &NamedLines::given);
        if (found == all.end()) found = all.insert(all.end(), {name, line.name, {}, false});
        found->lines.push_back(&line);
    }
    return all;
}

/// Samples of a branch from the first to the last by which lines of a name run.
struct NameRun {
    int name = -1;  // index of NamedLines; −1 = none
    int first = 0, last = 0;
};

double way_between(const CentrelineBranch& branch, int from, int to) {
    double length = 0;
    for (int i = from; i < to; ++i) length += (branch.points[i + 1] - branch.points[i]).norm();
    return length;
}

/// The longest run of the name along the branch; empty (last < first) when there is none. Gaps are bridged
/// where most of the samples between have the line near.
NameRun run_along(const CentrelineBranch& branch, const NamedLines& lines, int name) {
    Eigen::AlignedBox3d box;
    for (const GivenLine* line : lines.lines)
        for (const Vec3& p : line->points) box.extend(p);
    const int count = static_cast<int>(branch.points.size());
    std::vector<char> near(branch.points.size(), 0);
    for (int i = 0; i < count; ++i) {
        const double reach = near_radii * branch.radii[i];
        near[i] =
            box.exteriorDistance(branch.points[i]) <= reach && lines.distance_to(branch.points[i]) <= reach;
    }
    const auto first = std::ranges::find(near, 1), last = std::find(near.rbegin(), near.rend(), 1).base();
    if (first == near.end()) return {name, 0, -1};
    const auto covered = std::count(first, last, 1);
    NameRun run{name, static_cast<int>(first - near.begin()), static_cast<int>(last - near.begin()) - 1};
    if (static_cast<double>(covered) >= least_fraction * static_cast<double>(last - first)) return run;
    NameRun longest{name, 0, -1};
    for (int i = 0; i < count; ++i) {
        if (!near[i]) continue;
        int end = i;
        while (end + 1 < count && near[end + 1]) ++end;
        if (end - i > longest.last - longest.first) longest = {name, i, end};
        i = end;
    }
    return longest;
}

double width_of(const CentrelineBranch& branch, int from, int to) {
    double sum = 0;
    for (int i = from; i <= to; ++i) sum += branch.radii[i];
    return 2 * sum / (to - from + 1);
}

/// Where the branch has left its parent's lumen, at most at its middle.
int own_start(const Anatomy& anatomy, int b) {
    const CentrelineBranch& branch = anatomy.branches[b];
    if (branch.parent < 0) return 0;
    const CentrelineBranch& parent = anatomy.branches[branch.parent];
    const auto held = [&](const Vec3& x) {
        for (std::size_t i = 0; i < parent.points.size(); ++i)
            if ((x - parent.points[i]).norm() < parent.radii[i]) return true;
        return false;
    };
    int i = 0;
    while (2 * i < static_cast<int>(branch.points.size()) && held(branch.points[i])) ++i;
    return i;
}

/// The names along a branch from its start to its end: as few as cover it.
std::vector<NameRun> pieces_of(const Anatomy& anatomy, int b, const std::vector<NamedLines>& names) {
    constexpr double long_gap = 3;  // radii without a name
    const CentrelineBranch& branch = anatomy.branches[b];
    const int count = static_cast<int>(branch.points.size()), last = count - 1, start = own_start(anatomy, b);
    const double whole = way_between(branch, start, last);
    const auto short_gap = [&](int from, int to) {
        if (to <= from) return true;
        return way_between(branch, from, to) <= long_gap * 0.5 * width_of(branch, from, to);
    };
    std::vector<NameRun> runs;
    for (int n = 0; n < static_cast<int>(names.size()); ++n) {
        const NameRun run = run_along(branch, names[n], n);
        const int first = std::max(run.first, start);
        if (run.last <= first) continue;
        const double length = way_between(branch, first, run.last);
        if (length >= std::min(width_of(branch, first, run.last), 0.5 * whole)) runs.push_back(run);
    }
    std::vector<NameRun> pieces;
    for (int at = start; at < last;) {
        const NameRun* best = nullptr;
        for (const NameRun& run : runs) {
            if (run.last <= at || !short_gap(at, run.first)) continue;
            const auto gap = [&](const NameRun& r) { return names[r.name].gap_to_end(branch.points.back()); };
            // Lines that reach about as far: the one that ends there.
            const bool level =
                best && short_gap(std::min(best->last, run.last), std::max(best->last, run.last));
            if (!best || (level ? gap(run) < gap(*best) : run.last > best->last)) best = &run;
        }
        if (best) {
            NameRun piece = *best;
            piece.first = std::max(piece.first, at);
            if (!pieces
                     .empty()) {  // where they overlap, the border is in the middle, but near the end of one
                NameRun& before = pieces.back();
                int overlap = before.last - std::max(best->first, before.first + 1);
                while (overlap > 0 && way_between(branch, before.last - overlap, before.last) >
                                          0.75 * width_of(branch, before.last - overlap, before.last))
                    --overlap;
                if (before.name >= 0 && overlap > 0) before.last -= overlap / 2;
                if (before.name >= 0 && overlap < 0) before.last = (before.last + piece.first) / 2;
                piece.first = before.last;
            }
            pieces.push_back(piece);
            at = best->last;
            continue;
        }
        int next = last;
        for (const NameRun& run : runs)
            if (run.first > at) next = std::min(next, run.first);
        pieces.push_back({-1, pieces.empty() ? 0 : pieces.back().last, next});
        at = next;
    }
    // A rest without a name that is short belongs to the name before it.
    if (pieces.size() > 1 && pieces.back().name < 0 && short_gap(pieces.back().first, last))
        pieces.pop_back();
    if (pieces.empty()) pieces.push_back({-1, 0, last});
    pieces.front().first = 0;
    pieces.back().last = last;
    for (std::size_t k = 1; k < pieces.size(); ++k) pieces[k].first = pieces[k - 1].last;
    std::erase_if(pieces, [](const NameRun& piece) { return piece.last <= piece.first; });
    return pieces;
}

/// Cuts branches where names end, and gives the parts those names; others keep theirs. A part starts at the
/// last sample of the one before.
void split_at_names(Anatomy& anatomy, std::vector<NamedLines>& names, std::vector<std::string>& by_line) {
    std::vector<CentrelineBranch> split;
    std::vector<VesselTarget> targets;
    struct Part {
        int branch, first, last;
    };
    std::vector<std::vector<Part>> parts(anatomy.branches.size());
    for (int b = 0; b < static_cast<int>(anatomy.branches.size()); ++b) {
        const CentrelineBranch& branch = anatomy.branches[b];
        for (const NameRun& piece : pieces_of(anatomy, b, names)) {
            CentrelineBranch part;
            part.points.assign(branch.points.begin() + piece.first, branch.points.begin() + piece.last + 1);
            part.radii.assign(branch.radii.begin() + piece.first, branch.radii.begin() + piece.last + 1);
            if (!parts[b].empty()) {
                part.parent = parts[b].back().branch;
                part.parent_sample = parts[b].back().last - parts[b].back().first;
            } else if (branch.parent >= 0) {
                for (const Part& of : parts[branch.parent]) {
                    part.parent = of.branch;
                    part.parent_sample = branch.parent_sample - of.first;
                    if (branch.parent_sample <= of.last) break;
                }
            }
            part.name = parts[b].empty() ? branch.name : "";
            by_line.push_back(piece.name >= 0 ? names[piece.name].name : "");
            if (piece.name >= 0) names[piece.name].used = true;
            parts[b].push_back({static_cast<int>(split.size()), piece.first, piece.last});
            split.push_back(std::move(part));
        }
    }
    for (const VesselTarget& target : anatomy.targets) {
        const std::vector<Part>& of = parts[target.branch];
        for (std::size_t k = of.size(); k-- > 0;) {  // the last first: the way to it is the longest
            const int count = of[k].last - of[k].first;
            const int sample = of.size() == 1 ? target.sample : count * 9 / 10;
            targets.push_back(
                {split[of[k].branch].name, split[of[k].branch].points[sample], of[k].branch, sample});
        }
    }
    anatomy.branches = std::move(split);
    anatomy.targets = std::move(targets);
    std::set<std::string> taken;
    for (const CentrelineBranch& branch : anatomy.branches) taken.insert(branch.name);
    for (std::size_t b = 0; b < anatomy.branches.size(); ++b) {
        std::string& name = anatomy.branches[b].name;
        for (std::size_t number = b + 1; name.empty(); ++number)
            if (std::string free = fmt::format("B{}", number); taken.insert(free).second) name = free;
    }
}

/// Makes a target of every name that no branch has, where its line runs longest.
void name_places(Anatomy& anatomy, std::vector<NamedLines>& names, std::vector<Finding>& findings) {
    for (int n = 0; n < static_cast<int>(names.size()); ++n) {
        if (names[n].used) continue;
        NameRun best;
        int on = -1;
        double longest = -1;
        for (int b = 0; b < static_cast<int>(anatomy.branches.size()); ++b) {
            const NameRun run = run_along(anatomy.branches[b], names[n], n);
            if (run.last < run.first) continue;
            const double length = way_between(anatomy.branches[b], run.first, run.last);
            if (length > longest) longest = length, best = run, on = b;
        }
        if (on < 0) {
            findings.push_back({Finding::Kind::Warned,
                                fmt::format("'{}': its line runs along no vessel", names[n].name),
                                Finding::Topic::Names});
            continue;
        }
        const int sample = best.first + (best.last - best.first) * 9 / 10;
        anatomy.targets.push_back({names[n].name, anatomy.branches[on].points[sample], on, sample});
        findings.push_back(
            {Finding::Kind::Noted,
             fmt::format("the name '{}' is a target, {:.1f} mm from the start of a branch, not a "
                         "branch: its line runs along {:.1f} mm where another runs farther",
                         names[n].name, way_between(anatomy.branches[on], 0, sample), longest)});
    }
}

std::string without_side(const std::string& name) {
    for (const std::string_view side : {".in", ".out"})
        if (name.ends_with(side) && name.size() > side.size())
            return name.substr(0, name.size() - side.size());
    return name;
}

/// Numbers names that repeat; those the user chose come first.
void make_unique(std::vector<std::string>& names, const std::vector<bool>& chosen) {
    std::set<std::string> taken;
    for (const bool first : {true, false}) {
        for (std::size_t i = 0; i < names.size(); ++i) {
            if (chosen[i] != first) continue;
            const std::string wanted = names[i];
            for (int number = 2; !taken.insert(names[i]).second; ++number)
                names[i] = fmt::format("{}_{}", wanted, number);
        }
    }
}

/// The end that each place names.
std::vector<std::string> names_of_ends(const Anatomy& anatomy, std::span<const NamedPlace> places) {
    std::vector<std::string> names(anatomy.ends.size());
    for (const NamedPlace& place : places) {
        std::size_t nearest = 0;
        const auto distance = [&](std::size_t e) {
            return (anatomy.ends[e].opening.centre - place.at).norm();
        };
        for (std::size_t e = 1; e < names.size(); ++e)
            if (distance(e) < distance(nearest)) nearest = e;
        const geometry::OpenEnd& end = anatomy.ends[nearest].opening;
        if (distance(nearest) > farthest_end * end.radius) {
            std::vector<std::string> there;
            for (const VesselEnd& each : anatomy.ends) there.push_back(io::place_text(each.opening.centre));
            throw io::InputError(
                "--name {}: {} is {:.3g} mm from the nearest end; expected at most {:.3g} mm, ends are at {}",
                place.name, io::place_text(place.at), distance(nearest), farthest_end * end.radius,
                io::joined(there));
        }
        if (!names[nearest].empty())
            throw io::InputError("--name: '{}' and '{}' both name the end at {}; expected one name an end",
                                 names[nearest], place.name, io::place_text(end.centre));
        if (std::ranges::find(names, place.name) != names.end())
            throw io::InputError("--name: '{}' names two ends; expected names that differ", place.name);
        names[nearest] = place.name;
    }
    return names;
}

/// The branch that ends in an outlet, or starts at an inlet.
int branch_at(const Anatomy& anatomy, const VesselEnd& end) {
    int nearest = 0;
    const auto distance = [&](int b) {
        const Polyline& points = anatomy.branches[b].points;
        const Vec3& tip = end.role == EndRole::Inlet ? points.front() : points.back();
        return (tip - end.opening.centre).norm();
    };
    for (int b = 1; b < static_cast<int>(anatomy.branches.size()); ++b)
        if (distance(b) < distance(nearest)) nearest = b;
    return nearest;
}

Mat3 rotation(const std::string& text) {
    constexpr double none = 1e9;
    const double degrees = text.size() > 2 && text[1] == ':'
                               ? io::parse_number(std::string_view(text).substr(2)).value_or(none)
                               : none;
    const auto axis = std::string_view("xyz").find(text.empty() ? ' ' : text[0]);
    if (axis == std::string_view::npos || !(std::abs(degrees) <= 360))
        throw io::InputError(
            "--rotate: '{}' was found; expected AXIS:DEG such as z:90, x, y or z and -360 to 360",
            text.substr(0, 40));
    // Quarter turns are exact.
    const double quarters = degrees / 90;
    Mat3 turn = geometry::rotation(degrees * geometry::degree, Vec3::Unit(static_cast<int>(axis)));
    if (quarters == std::round(quarters)) turn = turn.array().round().matrix();
    return turn;
}

}  // namespace

NamedPlace parse_named_place(const std::string& text) {
    const std::size_t sign = text.find('=');
    NamedPlace place{text.substr(0, sign), Vec3::Zero()};
    const bool fine = !place.name.empty() && place.name.size() <= longest_name &&
                      std::ranges::all_of(place.name, may_stand_in_a_name);
    if (!fine)
        throw io::InputError(
            "--name {}: expected a name of 1 to {} bytes without control characters, quotes and backslashes "
            "before '='",
            sign == 0 ? "=" : "", longest_name);
    std::string_view rest = std::string_view(text).substr(sign == std::string::npos ? text.size() : sign + 1);
    for (int k = 0; k < 3; ++k) {
        const std::size_t comma = k < 2 ? rest.find(',') : rest.size();
        const auto value =
            comma == std::string_view::npos ? std::nullopt : io::parse_number(rest.substr(0, comma));
        if (!value || !std::isfinite(*value))
            throw io::InputError("--name {}: '{}' was found; expected NAME=X,Y,Z in mm", place.name,
                                 text.substr(0, 80));
        place.at[k] = *value;
        rest.remove_prefix(std::min(comma + 1, rest.size()));
    }
    return place;
}

std::vector<Finding> give_names(Anatomy& anatomy, std::span<const GivenLine> lines,
                                std::span<const NamedPlace> places) {
    std::vector<Finding> findings;
    std::vector<NamedLines> lines_by_name = by_name(lines);
    std::vector<std::string> along;  // names of lines along each branch, or none
    split_at_names(anatomy, lines_by_name, along);
    const std::size_t branches = anatomy.branches.size(), ends = anatomy.ends.size(),
                      own_targets = anatomy.targets.size();
    const std::vector<std::string> chosen = names_of_ends(anatomy, places);
    std::vector<std::string> names(branches), end_names(ends);
    std::vector<bool> by_user(branches, false), end_by_user(ends, false);
    for (std::size_t b = 0; b < branches; ++b)
        names[b] = along[b].empty() ? anatomy.branches[b].name : along[b];
    std::vector<std::string> targets = names;
    // Outlets first: what lies behind one decides its branch's name.
    for (const EndRole role : {EndRole::Outlet, EndRole::Inlet}) {
        for (std::size_t e = 0; e < ends; ++e) {
            if (anatomy.ends[e].role != role || chosen[e].empty()) continue;
            const auto b = static_cast<std::size_t>(branch_at(anatomy, anatomy.ends[e]));
            const std::string stem = without_side(chosen[e]);
            if (!by_user[b])
                names[b] = targets[b] = stem;
            else if (stem != names[b])
                names[b] = stem + "+" + names[b];
            by_user[b] = true;
        }
    }
    for (std::size_t b = 0; b < branches; ++b)
        if (by_user[b] && !along[b].empty() && names[b] != along[b])
            findings.push_back({Finding::Kind::Warned,
                                fmt::format("'{}': --name calls its branch '{}'", along[b], names[b]),
                                Finding::Topic::Names});
    name_places(anatomy, lines_by_name, findings);
    for (std::size_t t = own_targets; t < anatomy.targets.size(); ++t) {
        targets.push_back(anatomy.targets[t].name);
        by_user.push_back(false);
    }
    const std::vector<std::string> wanted = names, wanted_targets = targets;
    make_unique(names, {by_user.begin(), by_user.begin() + static_cast<std::ptrdiff_t>(branches)});
    make_unique(targets, by_user);
    const auto renamed = [&](const std::string& from, const std::string& to) {
        findings.push_back({Finding::Kind::Noted, fmt::format("the name '{}' became '{}'", from, to)});
    };
    for (const NamedLines& named : lines_by_name)
        if (named.given != named.name) renamed(io::as_utf8(named.given), named.name);
    for (std::size_t b = 0; b < branches; ++b)
        if (names[b] != wanted[b]) renamed(wanted[b], names[b]);
    for (std::size_t t = branches; t < targets.size(); ++t)
        if (targets[t] != wanted_targets[t]) renamed(wanted_targets[t], targets[t]);
    for (std::size_t e = 0; e < ends; ++e) {
        const auto b = static_cast<std::size_t>(branch_at(anatomy, anatomy.ends[e]));
        end_by_user[e] = !chosen[e].empty();
        end_names[e] = end_by_user[e] ? chosen[e]
                       : !along[b].empty()
                           ? names[b] + (anatomy.ends[e].role == EndRole::Inlet ? ".in" : ".out")
                           : anatomy.ends[e].opening.name;
    }
    make_unique(end_names, end_by_user);
    for (std::size_t t = 0; t < anatomy.targets.size(); ++t)
        anatomy.targets[t].name = t < own_targets
                                      ? targets[static_cast<std::size_t>(anatomy.targets[t].branch)]
                                      : targets[branches + t - own_targets];
    for (std::size_t b = 0; b < branches; ++b) anatomy.branches[b].name = names[b];
    for (std::size_t e = 0; e < ends; ++e) anatomy.ends[e].opening.name = end_names[e];
    return findings;
}

std::vector<Finding> give_targets(Anatomy& anatomy, std::span<const NamedPlace> places) {
    std::vector<Finding> findings;
    for (const NamedPlace& given : places) {
        const std::string name = usable(given.name);
        const VesselPlace place = nearest_place(anatomy, given.at);
        if (place.distance > 0 || name.empty()) {
            findings.push_back({Finding::Kind::Warned,
                                fmt::format("'{}': {} is {:.1f} mm outside the lumen", name,
                                            io::place_text(given.at), place.distance),
                                Finding::Topic::Names});
            continue;
        }
        std::erase_if(anatomy.targets, [&](const VesselTarget& target) { return target.name == name; });
        anatomy.targets.push_back(
            {name, anatomy.branches[place.branch].points[place.sample], place.branch, place.sample});
    }
    return findings;
}

Mat3 to_patient(const FileFrame& frame, const std::string& axes) {
    if (!(frame.scale >= 1e-6 && frame.scale <= 1e6))
        throw io::InputError("--scale: {} was found; expected 1e-6 to 1e6", frame.scale);
    Mat3 matrix = frame.scale * Mat3::Identity();
    if (axes == "ras") matrix = (Vec3(-1, -1, 1).asDiagonal() * matrix).eval();
    for (const std::string& text : frame.rotations) matrix = (rotation(text) * matrix).eval();
    return matrix;
}

void transform(const Mat3& matrix, std::vector<Vec3>& points) {
    if (matrix == Mat3::Identity()) return;
    for (Vec3& p : points) p = (matrix * p).eval();
}

namespace {

using geometry::Landmark;

struct Assumed {
    Vec3 at;
    const char* why;
};

/// In pelvis and abdomen the widest branch is an iliac artery.
Assumed bifurcation(const Anatomy& anatomy, const Eigen::AlignedBox3d& box) {
    const geometry::CentrelineBranch* widest = nullptr;
    const auto width = [](const geometry::CentrelineBranch& b) { return b.radii[b.radii.size() / 3]; };
    for (const geometry::CentrelineBranch& branch : anatomy.branches)
        if (branch.parent >= 0 && (!widest || width(branch) > width(*widest))) widest = &branch;
    if (widest) return {widest->points.front(), "where the widest branch leaves"};
    return {box.center(), "the middle of the vessels, which have no branch"};
}

/// Of the wide ends that of the ascending aorta lies in front.
Assumed valve(const Anatomy& anatomy) {
    const VesselEnd* best = nullptr;
    double widest = 0;
    for (const VesselEnd& end : anatomy.ends) widest = std::max(widest, end.opening.radius);
    for (const VesselEnd& end : anatomy.ends) {
        if (end.opening.radius < 0.7 * widest) continue;
        if (!best || end.opening.centre.y() < best->opening.centre.y()) best = &end;
    }
    return {best->opening.centre, "the foremost of the wide ends"};
}

/// The carotids pass beside the sella some way below the highest vessels.
Assumed sella(const Eigen::AlignedBox3d& box) {
    constexpr double below_top = 60, skull = 120;  // [mm]
    Vec3 at = box.center();
    if (box.sizes().z() <= skull) return {at, "the middle of the vessels"};
    at.z() = box.max().z() - below_top;
    return {at, "60 mm below the highest vessels, in their middle"};
}

}  // namespace

Landmark landmark_of_part(const std::string& part) {
    if (part == "pelvis" || part == "abdomen") return Landmark::AorticBifurcation;
    if (part == "chest") return Landmark::AorticValve;
    if (part == "head") return Landmark::Sella;
    throw io::InputError("--body: '{}' was found; expected pelvis, abdomen, chest or head",
                         part.substr(0, 40));
}

std::string place_in_part(Anatomy& anatomy, const std::string& part, const std::optional<Vec3>& landmark) {
    const Landmark hung_on = landmark_of_part(part);
    Eigen::AlignedBox3d box;
    for (const Vec3& v : anatomy.lumen.vertices) box.extend(v);
    const Assumed assumed = landmark                           ? Assumed{*landmark, "as given"}
                            : hung_on == Landmark::AorticValve ? valve(anatomy)
                            : hung_on == Landmark::Sella       ? sella(box)
                                                               : bifurcation(anatomy, box);
    anatomy.body = geometry::BodyPlace{hung_on, assumed.at};
    return fmt::format("in the body ({}) the {} lies at {}, {}{}", part, geometry::name_of(hung_on),
                       io::place_text(assumed.at), assumed.why,
                       landmark ? "" : "; --landmark X,Y,Z puts it elsewhere [mm]");
}

}  // namespace anatomy
