#include "engine/anatomy/import/lumen_import.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <numeric>

#include "engine/anatomy/import/given_centrelines.h"
#include "engine/anatomy/import/lumen_tracing.h"
#include "engine/anatomy/import/lumen_voxels.h"
#include "engine/anatomy/import/mesh_cut.h"
#include "engine/anatomy/mesh_file.h"
#include "engine/io/error.h"
#include "engine/io/text.h"

namespace anatomy {
namespace {

using geometry::TriangleMesh;
using geometry::Vec3;

/// Voxels across the radius of the thinnest vessels.
constexpr double voxels_per_radius = 2.2;
/// Limits on the memory of an import: a voxel takes half a byte in the box, 40 bytes inside.
constexpr double most_boxed = 4e8, most_inside = 2.5e6;
constexpr int most_false_tips = 40;

double unit_in_mm(const std::string& unit) {
    if (unit == "mm") return 1;
    if (unit == "cm") return 10;
    if (unit == "m") return 1000;
    throw io::InputError((unit.empty() ? "no unit was given, and a mesh file does not say its own"
                                       : fmt::format("unit '{}' was given", unit)) +
                         "; --unit mm, cm or m is accepted");
}

class Import {
public:
    Import(std::string name, const ImportOptions& options) : options_(options) {
        result_.anatomy.name = std::move(name);
    }

    ImportedLumen from(const TriangleMesh& given) {
        note("{} triangles", given.triangles.size());
        report(0.05, "mending the surface");
        RepairedLumen lumen = repaired(given);
        append(lumen.findings);
        report(0.1, "looking at the lumen");
        check_surface(lumen);
        const std::vector<geometry::Polyline> lines = read_lines();
        if (lumen.ends.empty()) open_tips(lumen, lines);
        if (lumen.ends.size() < 2) {
            throw io::InputError(
                fmt::format("{} open end{} found{}; two or more are accepted: an inlet and an outlet, cut "
                            "open across the vessel",
                            lumen.ends.size(), lumen.ends.size() == 1 ? " was" : "s were",
                            lumen.ends.empty() ? "" : " at " + io::place_text(lumen.ends[0].loop.centroid)));
        }
        const int inlet = choose_inlet(lumen.ends);
        const TracedLumen traced = trace(lumen, inlet, lines, 0.3, 0.9);
        check_tracing(traced, lumen.ends, inlet);
        assemble(lumen, traced, inlet);
        compare_radii();
        give_names(result_.anatomy, given_, options_.names);
        report(0.95, "checking the anatomy");
        check_result();
        report(1, "done");
        return std::move(result_);
    }

private:
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
        const geometry::Mat3 matrix = to_patient(options_.frame);
        for (const std::filesystem::path& file : options_.centrelines) {
            std::vector<GivenLine> lines = load_centrelines(file, unit_in_mm(options_.unit));
            warned(
                "the centrelines are {} line{} of {}, recentred; radii are measured on the mesh, whose "
                "median "
                "edge is {:.2f} of the radius",
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
            refused.push_back(fmt::format("{}: {} was found; {} is accepted{}", check.what, check.found,
                                          check.accepted, coarse ? " (--centrelines)" : ""));
        }
        if (!refused.empty()) throw io::InputError(io::joined(refused, "\n"));
    }

    TracingOptions tracing(const TriangleMesh& mesh, const TriangleMesh& whole, double from,
                           double to) const {
        TracingOptions options;
        options.threads = options_.threads;
        options.voxel =
            std::max({figures_.thin_radius / voxels_per_radius, thinnest_wire_radius() / voxels_per_radius,
                      std::cbrt(std::abs(geometry::signed_volume(whole)) / most_inside)});
        while (LumenVoxels::box_count(mesh, options.voxel) > most_boxed) options.voxel *= 1.1;
        options.step = options.voxel;
        options.progress = [this, from, to](double part) {
            report(from + part * (to - from), "finding the branches");
        };
        return options;
    }

    TracedLumen trace(const RepairedLumen& lumen, int inlet, const std::vector<geometry::Polyline>& lines,
                      double from, double to) {
        TracingOptions options = tracing(lumen.mesh, closed(lumen), from, to);
        if (!lines.empty()) return trace_lines(lumen.mesh, lumen.ends, inlet, lines, options);
        TracedLumen traced = trace_lumen(lumen.mesh, lumen.ends, inlet, options);
        if (traced.unreached.empty()) return traced;
        // A narrow passage may have been lost between the voxels.
        options.voxel *= 0.6;
        if (LumenVoxels::box_count(lumen.mesh, options.voxel) > most_boxed) return traced;
        return trace_lumen(lumen.mesh, lumen.ends, inlet, options);
    }

    void open_tips(RepairedLumen& lumen, const std::vector<geometry::Polyline>& lines) {
        const TracedLumen traced = trace(lumen, -1, lines, 0.1, 0.3);
        check_false_tips(traced);
        for (const VesselTip& tip : traced.tips) {
            const TriangleMesh cut = cut_beyond(lumen.mesh, tip.centre, tip.outward, tip.apex);
            const geometry::Topology left = geometry::topology(cut);
            if (left.non_manifold_edges > 0 || left.loops.size() != lumen.ends.size() + 1) {
                warned("the blind tip at {} could not be cut open and stays closed",
                       io::place_text(tip.apex));
                continue;
            }
            lumen.mesh = cut;
            lumen.ends = openings_of(cut);
        }
        warned("the lumen is closed: its {} tips, at which the vessels were cut open, are taken for ends",
               lumen.ends.size());
    }

    int choose_inlet(const std::vector<MeshOpening>& ends) {
        if (!options_.inlet) {
            std::string others;
            for (std::size_t e = 1; e < ends.size(); ++e)
                others += fmt::format("{} {} r {:.2f}", e > 1 ? "," : "",
                                      io::place_text(ends[e].loop.centroid), ends[e].radius);
            note("the inlet is the largest end, {} r {:.2f}; --inlet X,Y,Z takes another [mm]:{}",
                 io::place_text(ends[0].loop.centroid), ends[0].radius, others);
            return 0;
        }
        int best = 0;
        const auto distance = [&](int e) { return (ends[e].loop.centroid - *options_.inlet).norm(); };
        for (int e = 1; e < static_cast<int>(ends.size()); ++e)
            if (distance(e) < distance(best)) best = e;
        note("the inlet is the end at {}, {:.2f} mm from the place given",
             io::place_text(ends[best].loop.centroid), distance(best));
        return best;
    }

    void check_false_tips(const TracedLumen& traced) const {
        const std::size_t count = traced.tips.size() + traced.spurs;
        if (count <= most_false_tips) return;
        throw io::InputError(fmt::format(
            "{} tips and bulges shorter than two radii were found, such as at {}: this is not a tree of "
            "tubes, or too "
            "coarse for one; up to {} are accepted, or centrelines beside the mesh (--centrelines)",
            count, traced.tips.empty() ? "its middle" : io::place_text(traced.tips.back().apex),
            most_false_tips));
    }

    void check_tracing(const TracedLumen& traced, const std::vector<MeshOpening>& ends, int inlet) {
        check_false_tips(traced);
        std::vector<std::string> lost;
        for (const int e : traced.unreached) lost.push_back(io::place_text(ends[e].loop.centroid));
        if (!lost.empty()) {
            throw io::InputError(
                fmt::format("no way through the lumen leads from the inlet at {} to the end at {}; a "
                            "lumen in one piece is accepted",
                            io::place_text(ends[inlet].loop.centroid), io::joined(lost)));
        }
        if (traced.branches.empty())
            throw io::InputError("no vessel was found inside the surface; a lumen is accepted");
        if (traced.spurs > 0) note("{} bulges shorter than two radii are not branches", traced.spurs);
        for (const VesselTip& tip : traced.tips) note("a branch ends blind at {}", io::place_text(tip.apex));
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
                    fmt::format("{}: {} was found; {} is accepted", check.what, check.found, check.accepted));
            }
        }
        if (!refused.empty()) throw io::InputError(io::joined(refused, "\n"));
    }

    const ImportOptions& options_;
    SurfaceFigures figures_;
    std::vector<GivenLine> given_;  // centrelines, in the patient's frame
    ImportedLumen result_;
};

}  // namespace

ImportedLumen import_lumen(const TriangleMesh& mesh, const std::string& name, const ImportOptions& options) {
    return Import(name, options).from(mesh);
}

ImportedLumen import_lumen(const std::filesystem::path& path, const ImportOptions& options) {
    const double unit = unit_in_mm(options.unit);
    const geometry::Mat3 matrix = to_patient(options.frame);
    if (options.progress) options.progress(0, "reading the mesh");
    TriangleMesh mesh = load_mesh(path);
    for (Vec3& v : mesh.vertices) v *= unit;
    transform(matrix, mesh.vertices);
    try {
        return import_lumen(mesh, path.stem().string(), options);
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
