#include "engine/anatomy/import/lumen_import.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <numeric>
#include <string>
#include <vector>

#include "engine/anatomy/import/end_choice.h"
#include "engine/anatomy/import/given_centrelines.h"
#include "engine/anatomy/import/lumen_tracing.h"
#include "engine/anatomy/import/lumen_voxels.h"
#include "engine/anatomy/mesh_file.h"
#include "engine/io/error.h"
#include "engine/io/text.h"
#include "physics/geometry/maths.h"
#include "physics/geometry/polyline.h"

namespace anatomy {
namespace {

struct Pruning {
    std::vector<std::string> lines;  // one for each branch that was cut: where, how thin, what is lost
    std::vector<int> closed;         // openings that lie beyond
    double length = 0;               // of all that was cut [mm]
};

/// The first sample that is too thin; the number of samples when none is.
std::size_t first_thin(const CentrelineBranch& branch, double least) {
    std::size_t i = 1;
    while (i < branch.points.size() && branch.radii[i] >= least) ++i;
    return i;
}

double length_between(const CentrelineBranch& branch, std::size_t from, std::size_t to) {
    double length = 0;
    for (std::size_t i = from + 1; i < to && i < branch.points.size(); ++i)
        length += (branch.points[i] - branch.points[i - 1]).norm();
    return length;
}

/// Cuts every branch where its inscribed radius first falls below `least`, and drops the branches that leave
/// it beyond. A branch that would be no longer than the vessel it leaves is wide is dropped whole. The root
/// keeps its first sample.
Pruning prune_thin(TracedLumen& traced, double least) {
    Pruning pruning;
    std::vector<CentrelineBranch>& branches = traced.branches;
    const int count = static_cast<int>(branches.size());
    std::vector<std::size_t> kept(branches.size());  // samples of each
    std::vector<int> cause(branches.size(), -1);     // the line that reports the loss of a branch
    std::vector<int> beyond;                         // branches lost with that of a line
    for (int b = 0; b < count; ++b) {
        CentrelineBranch& branch = branches[b];
        const bool lost = branch.parent >= 0 && cause[branch.parent] >= 0 &&
                          static_cast<std::size_t>(branch.parent_sample) >= kept[branch.parent];
        if (lost) {
            cause[b] = cause[branch.parent];
            kept[b] = 0;
            ++beyond[cause[b]];
            pruning.length += geometry::length_of(branch.points);
        } else {
            kept[b] = first_thin(branch, least);
            if (kept[b] == branch.points.size()) continue;
            const std::size_t thin = kept[b];
            if (branch.parent >= 0) {
                const double wide = branches[branch.parent].radii[branch.parent_sample];
                if (kept[b] < 3 || length_between(branch, 0, kept[b]) < 2 * wide) kept[b] = 0;
            } else if (kept[b] < 2) {
                kept[b] = branch.points.size();  // refused by the check of the smallest radius
                continue;
            }
            const double length = length_between(branch, kept[b], branch.points.size());
            cause[b] = static_cast<int>(pruning.lines.size());
            beyond.push_back(0);
            pruning.length += length;
            pruning.lines.push_back(fmt::format("radius {:.3f} at {}, {:.1f} mm", branch.radii[thin],
                                                io::place_text(branch.points[thin]), length));
        }
        if (const int end = traced.end_of_branch[b]; end >= 0) pruning.closed.push_back(end);
        traced.end_of_branch[b] = -1;
    }
    for (std::size_t line = 0; line < pruning.lines.size(); ++line)
        if (beyond[line] > 0)
            pruning.lines[line] +=
                fmt::format(" and {} branch{} beyond", beyond[line], beyond[line] == 1 ? "" : "es");

    std::vector<int> place(branches.size(), -1);
    std::vector<CentrelineBranch> left;
    std::vector<int> ends;
    for (int b = 0; b < count; ++b) {
        if (kept[b] == 0) continue;
        CentrelineBranch& branch = branches[b];
        branch.points.resize(kept[b]);
        branch.radii.resize(kept[b]);
        if (branch.parent >= 0) branch.parent = place[branch.parent];
        place[b] = static_cast<int>(left.size());
        left.push_back(std::move(branch));
        ends.push_back(traced.end_of_branch[b]);
    }
    branches = std::move(left);
    traced.end_of_branch = std::move(ends);
    std::erase_if(traced.tips, [&](const VesselTip& tip) { return cause[tip.branch] >= 0; });
    for (VesselTip& tip : traced.tips) tip.branch = place[tip.branch];
    return pruning;
}

/// Voxels across the radius of the thinnest vessels.
constexpr double voxels_per_radius = 2.2;
/// Limits on the memory of an import: a voxel takes half a byte in the box, 40 bytes inside.
constexpr double most_boxed = 4e8, most_inside = 1.5e6;
constexpr int most_tips = 500, most_spurs = 40;
constexpr double coarse_edge = 0.6;  // of the radius, median
/// A lumen at least this many times as long as wide is a vessel.
constexpr double least_slenderness = 1.25;
/// Vessels that span less than this may be in centimetres [mm].
constexpr double small_span = 60, large_span = 2500;

double unit_in_mm(const std::string& unit) {
    if (unit == "mm") return 1;
    if (unit == "cm") return 10;
    if (unit == "m") return 1000;
    throw io::InputError((unit.empty() ? "no unit was given, and a mesh file does not say its own"
                                       : fmt::format("unit '{}' was given", unit)) +
                         "; expected --unit mm, cm or m");
}

/// `otherwise`: why a file is taken so that does not say.
void note_axes(const std::filesystem::path& file, const TakenAxes& axes, std::vector<Finding>& findings,
               const char* otherwise) {
    const bool ras = axes.axes == "ras";
    findings.push_back(
        {Finding::Kind::Noted,
         fmt::format("{} is in {} (+x {}, +y {}), {}", file.filename().string(), ras ? "RAS" : "LPS",
                     ras ? "right" : "left", ras ? "front" : "back", axes.known ? axes.why : otherwise),
         Finding::Topic::Axes});
}

class Import {
public:
    Import(std::string name, const ImportOptions& options, std::string axes, std::vector<Finding> found)
        : options_(options), axes_(std::move(axes)) {
        result_.anatomy.name = std::move(name);
        result_.findings = std::move(found);
        result_.axes = axes_;
    }

    ImportedLumen from(const TriangleMesh& given) {
        try {
            return work_on(given);
        } catch (const io::InputError& error) {
            std::string text = error.what();
            for (const Finding& finding : result_.findings) text += "\n" + text_of(finding);
            throw io::InputError(text);
        }
    }

private:
    ImportedLumen work_on(const TriangleMesh& given) {
        note("{} triangles", given.triangles.size());
        report(0.05, "mending the surface");
        RepairedLumen lumen = repaired(given);
        append(lumen.findings);
        report(0.1, "looking at the lumen");
        check_surface(lumen);
        const std::vector<geometry::Polyline> lines = read_lines();
        // Traced for its tips first, where ends may be missing, and again once they are open.
        const int largest = lumen.ends.empty() ? -1 : 0;
        TracedLumen traced = trace(lumen, largest, lines, 0.1, 0.4);
        check_false_tips(traced);
        check_slender(traced);
        const GivenEnds ends{options_.inlet, options_.ends, options_.open_tubes};
        const bool opened = open_missing_ends(lumen, traced, ends, result_.findings);
        int inlet = chosen_inlet(lumen.ends, ends, result_.findings);
        if (opened || inlet != largest) traced = trace(lumen, inlet, lines, 0.4, 0.9);
        check_tracing(traced, lumen.ends, inlet);
        if (!missing_.empty()) warned("{}", missing_);
        prune(lumen, traced, inlet);
        assemble(lumen, traced, inlet);
        compare_radii();
        std::vector<NamedPlace> names = options_.names, targets;
        read_places(names, targets);
        append(give_names(result_.anatomy, given_, names));
        append(give_targets(result_.anatomy, targets));
        report(0.95, "checking the anatomy");
        check_result();
        report(1, "done");
        return std::move(result_);
    }

    void report(double part, const char* what) const {
        if (options_.progress) options_.progress(part, what);
    }
    void append(const std::vector<Finding>& more) {
        result_.findings.insert(result_.findings.end(), more.begin(), more.end());
    }
    template <class... Values>
    void note(fmt::format_string<Values...> text, Values&&... values) {
        result_.findings.push_back(
            {Finding::Kind::Noted, fmt::format(text, std::forward<Values>(values)...)});
    }
    template <class... Values>
    void warned(fmt::format_string<Values...> text, Values&&... values) {
        result_.findings.push_back(
            {Finding::Kind::Warned, fmt::format(text, std::forward<Values>(values)...)});
    }

    std::vector<geometry::Polyline> read_lines() {
        for (const std::filesystem::path& file : options_.centrelines) {
            GivenLines read = load_centrelines(file, unit_in_mm(options_.unit));
            std::vector<GivenLine>& lines = read.lines;
            const TakenAxes axes = taken_axes(file.string(), read.axes, options_.frame.axes,
                                              "--axes " + options_.frame.axes, axes_);
            note_axes(file, axes, result_.findings, "as the mesh is, for it does not say");
            const geometry::Mat3 matrix = to_patient(options_.frame, axes.axes);
            warned(
                "the centrelines are {} line{} of {}, recentred; radii are measured on the mesh, whose "
                "median edge is {:.2f} of the radius",
                lines.size(), lines.size() == 1 ? "" : "s", file.filename().string(), figures_.edge_ratio);
            for (GivenLine& line : lines) {
                transform(matrix, line.points);
                for (double& radius : line.radii) radius *= options_.frame.scale;
                given_.push_back(std::move(line));
            }
        }
        std::vector<geometry::Polyline> lines;
        for (const GivenLine& line : given_) lines.push_back(line.points);
        return lines;
    }

    /// Points at an end name it; others are targets.
    void read_places(std::vector<NamedPlace>& of_ends, std::vector<NamedPlace>& targets) {
        for (const std::filesystem::path& file : options_.places) {
            const GivenPlaces read = load_places(file);
            const TakenAxes axes = taken_axes(file.string(), read.axes, options_.frame.axes,
                                              "--axes " + options_.frame.axes, axes_);
            note_axes(file, axes, result_.findings, "as the mesh is, for it does not say");
            const geometry::Mat3 matrix = to_patient(options_.frame, axes.axes);
            for (const auto& [name, at] : read.places) {
                const Vec3 place = matrix * at;
                const bool end = std::ranges::any_of(result_.anatomy.ends, [&](const VesselEnd& each) {
                    return (each.opening.centre - place).norm() < each.opening.radius;
                });
                (end ? of_ends : targets).push_back({name, place});
            }
        }
    }

    /// Says how radii that came with the lines compare with those measured.
    void compare_radii() {
        std::vector<double> ratios;
        for (const GivenLine& line : given_) {
            if (line.radii.size() != line.points.size()) continue;
            for (std::size_t i = 0; i < line.points.size(); i += 1 + line.points.size() / 100) {
                const VesselPlace place = nearest_place(result_.anatomy, line.points[i]);
                if (place.distance <= 0)
                    ratios.push_back(line.radii[i] /
                                     result_.anatomy.branches[place.branch].radii[place.sample]);
            }
        }
        if (ratios.empty()) return;
        std::nth_element(ratios.begin(), ratios.begin() + std::ssize(ratios) / 2, ratios.end());
        note("radii given with the centrelines are {:.2f} times those measured, in the median",
             ratios[ratios.size() / 2]);
    }

    static TriangleMesh closed(const RepairedLumen& lumen) {
        return geometry::capped(lumen.mesh, geometry::topology(lumen.mesh).loops);
    }

    void check_surface(const RepairedLumen& lumen) {
        figures_ = surface_figures(closed(lumen));
        std::vector<std::string> refused;
        for (const Check& check : surface_checks(figures_, options_.unit)) {
            if (check.verdict != Check::Verdict::Fail) continue;
            const bool coarse = check.what == "median edge";
            if (coarse && !options_.centrelines.empty()) {
                warned("the mesh is coarse: {} {}; radii are those of its facets", check.what, check.found);
                continue;
            }
            refused.push_back(fmt::format("{}: {} was found; expected {}{}", check.what, check.found,
                                          check.accepted, coarse ? " (--centrelines)" : ""));
        }
        if (!refused.empty()) throw io::InputError(io::joined(refused, "\n"));
        Eigen::AlignedBox3d box;
        for (const Vec3& v : lumen.mesh.vertices) box.extend(v);
        const double span = box.diagonal().norm();
        if (span > large_span)
            throw io::InputError(
                "vessels that span {:.0f} mm were found; expected up to {:.0f}: is the unit right, or does a "
                "corner lie far away?",
                span, large_span);
        note("the vessels span {:.0f} mm, half of their radii are above {:.2g} mm", span,
             figures_.median_radius);
        if (span < small_span && options_.unit == "mm") {
            warned(
                "vessels that span only {:.0f} mm were found: if the numbers of the file are centimetres, "
                "give --unit cm",
                span);
        }
        warn_of_spikes(lumen.mesh);
    }

    /// A corner far from all its neighbours is a slip of the program that wrote the mesh.
    void warn_of_spikes(const TriangleMesh& mesh) {
        std::vector<double> nearest(mesh.vertices.size(), std::numeric_limits<double>::infinity());
        for (const auto& t : mesh.triangles)
            for (int k = 0; k < 3; ++k) {
                const int a = t[k], b = t[(k + 1) % 3];
                const double length = (mesh.vertices[a] - mesh.vertices[b]).norm();
                nearest[a] = std::min(nearest[a], length);
                nearest[b] = std::min(nearest[b], length);
            }
        std::vector<double> ordered = nearest;
        const auto middle = ordered.begin() + std::ssize(ordered) / 2;
        std::ranges::nth_element(ordered, middle);
        constexpr double usual_lengths = 20;
        const auto farthest =
            std::ranges::max_element(nearest, {}, [](double d) { return std::isfinite(d) ? d : 0; });
        if (!std::isfinite(*farthest) || *farthest < usual_lengths * *middle) return;
        warned("a corner stands out {:.0f} mm from its neighbours, at {}: a fault of the mesh?", *farthest,
               io::place_text(mesh.vertices[static_cast<std::size_t>(farthest - nearest.begin())]));
    }

    TracingOptions tracing(const TriangleMesh& mesh, const TriangleMesh& whole, double from,
                           double to) const {
        TracingOptions options;
        options.threads = options_.threads;
        options.voxel =
            std::max({figures_.thin_radius / voxels_per_radius, thinnest_wire_radius / voxels_per_radius,
                      geometry::cbrt(std::abs(geometry::signed_volume(whole)) / most_inside)});
        while (LumenVoxels::box_count(mesh, options.voxel) > most_boxed) options.voxel *= 1.1;
        options.step = options.voxel;
        options.most_tips = most_tips;
        options.progress = [this, from, to](double part) {
            report(from + part * (to - from), "finding the branches");
        };
        return options;
    }

    TracedLumen trace(const RepairedLumen& lumen, int inlet, const std::vector<geometry::Polyline>& lines,
                      double from, double to) {
        TracingOptions options = tracing(lumen.mesh, closed(lumen), from, to);
        if (!lines.empty()) {
            TracedLumen traced = trace_lines(lumen.mesh, lumen.ends, inlet, lines, options);
            std::vector<geometry::Polyline> all = lines;
            missing_.clear();
            if (!traced.unreached.empty())
                add_missing(traced.unreached, trace_lumen(lumen.mesh, lumen.ends, inlet, options), lumen.ends,
                            all);
            return all.size() == lines.size() ? traced
                                              : trace_lines(lumen.mesh, lumen.ends, inlet, all, options);
        }
        TracedLumen traced = trace_lumen(lumen.mesh, lumen.ends, inlet, options);
        if (traced.unreached.empty()) return traced;
        // A narrow passage may have been lost between the voxels.
        options.voxel *= 0.6;
        if (LumenVoxels::box_count(lumen.mesh, options.voxel) > most_boxed) return traced;
        return trace_lumen(lumen.mesh, lumen.ends, inlet, options);
    }

    /// Ways from the inlet to ends that the given lines leave out.
    void add_missing(const std::vector<int>& unreached, const TracedLumen& traced,
                     const std::vector<MeshOpening>& ends, std::vector<geometry::Polyline>& lines) {
        std::vector<std::string> added;
        for (const int end : unreached) {
            const auto reaching = std::ranges::find(traced.end_of_branch, end);
            if (reaching == traced.end_of_branch.end()) continue;
            geometry::Polyline way;  // from the end
            int sample = -1;
            for (auto b = static_cast<int>(reaching - traced.end_of_branch.begin()); b >= 0;
                 sample = traced.branches[b].parent_sample, b = traced.branches[b].parent) {
                const geometry::Polyline& points = traced.branches[b].points;
                const auto last = sample < 0 ? points.end() : points.begin() + sample + 1;
                way.insert(way.end(), std::reverse_iterator(last), points.rend());
            }
            std::ranges::reverse(way);
            lines.push_back(std::move(way));
            added.push_back(io::place_text(ends[end].loop.centroid));
        }
        if (!added.empty())
            missing_ = fmt::format(
                "the centrelines lead to {} of {} ends; the ways to the others were found in the lumen [mm]: "
                "{}",
                ends.size() - 1 - unreached.size(), ends.size() - 1, io::joined(added));
    }

    void check_slender(const TracedLumen& traced) const {
        if (traced.branches.size() != 1) return;
        const geometry::CentrelineBranch& only = traced.branches[0];
        const double width = 2 * *std::ranges::max_element(only.radii);
        double length = geometry::length_of(only.points);
        for (const VesselTip& tip : traced.tips) length += (tip.apex - tip.centre).norm();
        if (length >= least_slenderness * width) return;
        throw io::InputError(
            "the surface is {:.1f} mm long and {:.1f} mm wide: a ball, not a vessel; expected a lumen at "
            "least {} times as long as wide",
            length, width, least_slenderness);
    }

    /// Closes the ends that no wire can reach and drops them.
    void prune(RepairedLumen& lumen, TracedLumen& traced, int& inlet) {
        const double least = thinnest_wire_radius;
        const Pruning pruning = prune_thin(traced, least);
        if (pruning.lines.empty()) return;
        if (lumen.ends.size() - pruning.closed.size() < 2) {
            throw io::InputError(
                "smallest radius: vessels thinner than {:.3f} mm, the thinnest wire's, leave no way from one "
                "end to another [mm]: {}; expected a lumen that a wire can pass",
                least, io::joined(pruning.lines));
        }
        std::vector<geometry::BoundaryLoop> loops;
        std::vector<int> place(lumen.ends.size(), -1);
        std::vector<MeshOpening> ends;
        for (int e = 0; e < static_cast<int>(lumen.ends.size()); ++e) {
            if (std::ranges::find(pruning.closed, e) != pruning.closed.end()) {
                loops.push_back(lumen.ends[e].loop);
                continue;
            }
            place[e] = static_cast<int>(ends.size());
            ends.push_back(lumen.ends[e]);
        }
        lumen.mesh = geometry::capped(lumen.mesh, loops);
        for (Vec3& v : lumen.mesh.vertices) v = v.cast<float>().cast<double>();
        lumen.ends = std::move(ends);
        inlet = place[inlet];
        for (int& end : traced.end_of_branch)
            if (end >= 0) end = place[end];
        warned(
            "{:.1f} mm of vessels thinner than {:.3f} mm, the thinnest wire's radius, were pruned; they stay "
            "in the surface [mm]: {}",
            pruning.length, least, io::joined(pruning.lines));
        result_.findings.back().topic = Finding::Topic::Removed;
    }

    void check_false_tips(const TracedLumen& traced) const {
        // A fine surface may be rough; on a coarse one bulges are its facets.
        const int most_bulges = figures_.edge_ratio > coarse_edge ? 2 : 10;
        const int tips = static_cast<int>(traced.tips.size()),
                  branches = static_cast<int>(traced.branches.size());
        const bool lumpy = traced.spurs > most_spurs && traced.spurs > most_bulges * branches;
        if (tips <= most_tips && !lumpy) return;
        throw io::InputError(
            "{} tips and {} bulges shorter than two radii were found on {} branches, such as at {}: this is "
            "not a tree of tubes, or too coarse for one; expected at most {} tips and {} bulges a branch, or "
            "centrelines beside the mesh (--centrelines)",
            tips, traced.spurs, branches, tips == 0 ? "its middle" : io::place_text(traced.tips.back().apex),
            most_tips, most_bulges);
    }

    void check_tracing(const TracedLumen& traced, const std::vector<MeshOpening>& ends, int inlet) {
        check_false_tips(traced);
        std::vector<std::string> lost;
        for (const int e : traced.unreached) lost.push_back(io::place_text(ends[e].loop.centroid));
        if (!lost.empty()) {
            throw io::InputError(
                "no {} from the inlet at {} to the end at {}; expected {}",
                options_.centrelines.empty() ? "way through the lumen leads"
                                             : "centreline that was given leads",
                io::place_text(ends[inlet].loop.centroid), io::joined(lost),
                options_.centrelines.empty() ? "a lumen in one piece" : "lines to all ends, or none at all");
        }
        if (traced.branches.empty())
            throw io::InputError("no vessel was found inside the surface; expected a lumen");
        if (traced.spurs > 0) note("{} bulges shorter than two radii are not branches", traced.spurs);
        if (!traced.tips.empty())
            note("{} branch{} blind; --end X,Y,Z cuts one open [mm]: {}", traced.tips.size(),
                 traced.tips.size() == 1 ? " ends" : "es end", places_text(traced.tips));
        if (traced.loops > 0)
            warned("{} branch{} in another: a loop, which is kept", traced.loops,
                   traced.loops == 1 ? " ends" : "es end");
    }

    void assemble(RepairedLumen& lumen, const TracedLumen& traced, int inlet) {
        Anatomy& anatomy = result_.anatomy;
        anatomy.lumen = std::move(lumen.mesh);
        // Distance along the vessels from the inlet to the start of each branch.
        const int count = static_cast<int>(traced.branches.size());
        std::vector<double> start(count, 0);
        for (int b = 0; b < count; ++b) {
            const auto& branch = traced.branches[b];
            if (branch.parent < 0) continue;
            const auto& parent = traced.branches[branch.parent].points;
            start[b] = start[branch.parent];
            for (int i = 0; i < branch.parent_sample; ++i) start[b] += (parent[i + 1] - parent[i]).norm();
        }
        std::vector<int> order(count), place(count);
        std::iota(order.begin(), order.end(), 0);
        std::stable_sort(order.begin() + 1, order.end(), [&](int a, int b) { return start[a] < start[b]; });
        // A branch that starts where its parent does stays after it.
        for (bool moved = true; moved;) {
            moved = false;
            for (int k = 0; k < count; ++k) place[order[k]] = k;
            for (int k = 0; k < count && !moved; ++k) {
                const int parent = traced.branches[order[k]].parent;
                if (parent < 0 || place[parent] < k) continue;
                std::swap(order[k], order[place[parent]]);
                moved = true;
            }
        }
        add_end(lumen.ends[inlet], EndRole::Inlet);
        for (int k = 0; k < count; ++k) {
            geometry::CentrelineBranch branch = traced.branches[order[k]];
            branch.name = fmt::format("B{}", k + 1);
            if (branch.parent >= 0) branch.parent = place[branch.parent];
            const int last = static_cast<int>(branch.points.size()) - 1, sample = last * 9 / 10;
            anatomy.targets.push_back({branch.name, branch.points[sample], k, sample});
            anatomy.branches.push_back(std::move(branch));
            if (const int e = traced.end_of_branch[order[k]]; e >= 0) add_end(lumen.ends[e], EndRole::Outlet);
        }
    }
    void add_end(const MeshOpening& opening, EndRole role) {
        VesselEnd end;
        end.opening.name = fmt::format("END{}", result_.anatomy.ends.size() + 1);
        end.opening.centre = opening.loop.centroid;
        end.opening.outward_normal = opening.normal;
        end.opening.radius = opening.radius;
        end.role = role;
        result_.anatomy.ends.push_back(std::move(end));
    }

    void check_result() {
        std::vector<std::string> refused = problems(result_.anatomy);
        if (refused.empty()) {
            result_.checks = anatomy_checks(result_.anatomy);
            for (Check& check : result_.checks) {
                if (check.verdict != Check::Verdict::Fail) continue;
                if (check.what == "median edge" && !options_.centrelines.empty()) {
                    check.verdict = Check::Verdict::Warning;
                    continue;
                }
                refused.push_back(
                    fmt::format("{}: {} was found; expected {}", check.what, check.found, check.accepted));
            }
        }
        if (!refused.empty()) throw io::InputError(io::joined(refused, "\n"));
    }

    const ImportOptions& options_;
    const std::string axes_;  // of the mesh
    SurfaceFigures figures_;
    std::string missing_;           // which ends the given centrelines leave out
    std::vector<GivenLine> given_;  // centrelines, in the patient's frame
    ImportedLumen result_;
};

}  // namespace

ImportedLumen import_lumen(const TriangleMesh& mesh, const std::string& name, const ImportOptions& options,
                           const std::string& axes, std::vector<Finding> found) {
    return Import(name, options, axes, std::move(found)).from(mesh);
}

ImportedLumen import_lumen(const std::filesystem::path& path, const ImportOptions& options) {
    const double unit = unit_in_mm(options.unit);
    to_patient(options.frame);  // what is wrong in it is said first
    if (options.progress) options.progress(0, "reading the mesh");
    StatedMesh read = load_stated_mesh(path);
    const TakenAxes axes =
        taken_axes(path.string(), read.axes, options.frame.axes, "--axes " + options.frame.axes);
    std::vector<Finding> found;
    note_axes(path, axes, found, "a guess, for it does not say; --axes ras takes the other");
    TriangleMesh mesh = std::move(read.mesh);
    for (Vec3& v : mesh.vertices) v *= unit;
    transform(to_patient(options.frame, axes.axes), mesh.vertices);
    for (const Vec3& v : mesh.vertices)
        if (!(v.cwiseAbs().maxCoeff() <= largest_coordinate))
            throw io::InputError(
                "{}: a corner at ({:g}, {:g}, {:g}) mm was found; expected coordinates up to {:g} mm: is the "
                "unit right?",
                path.string(), v.x(), v.y(), v.z(), largest_coordinate);
    try {
        return import_lumen(mesh, path.stem().string(), options, axes.axes, std::move(found));
    } catch (const io::InputError& error) {
        std::string text;
        for (std::size_t at = 0; const char c : std::string(error.what())) {
            if (at++ == 0 || text.back() == '\n') text += path.string() + ": ";
            text += c;
        }
        throw io::InputError(text);
    }
}

}  // namespace anatomy
