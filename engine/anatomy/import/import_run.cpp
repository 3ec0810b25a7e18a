#include "engine/anatomy/import/import_run.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <numbers>
#include <tuple>

#include "engine/anatomy/anatomy_writer.h"
#include "engine/anatomy/import/given_centrelines.h"
#include "engine/anatomy/import/naming.h"
#include "engine/anatomy/lumen_wall.h"
#include "engine/anatomy/organs.h"
#include "engine/io/error.h"
#include "engine/io/files.h"
#include "engine/io/text.h"
#include "engine/patient/ct_image.h"
#include "physics/geometry/maths.h"
#include "physics/geometry/polyline.h"

namespace anatomy {
namespace {

/// Of the way to the target, and at most [mm].
constexpr double inserted_fraction = 0.4, most_inserted = 60;
/// Of the lumen's width; a wire as wide as the lumen would be wedged by the mesh's facets.
constexpr double width_fraction = 0.9;
/// What the default C-arm shows around its isocentre, with a margin [mm].
constexpr double field = 170;

std::string decimal(double number) {
    return io::number_text(std::round(number * 10) / 10 + 0.0);
}

double degrees(double angle) {
    return angle * 180 / std::numbers::pi;
}

constexpr FirstWire wires[] = {
    {"glide035", 0.889, 16}, {"v18", 0.457, 8}, {"standard014", 0.356, 8}, {"floppy014", 0.356, 8}};

/// The first that passes as far as the target and has room at the start; the thinnest if none.
const FirstWire& wire_for(double narrowest, double room) {
    for (const FirstWire& wire : wires)
        if (wire.diameter < width_fraction * narrowest && wire.least_inserted <= room) return wire;
    return std::end(wires)[-1];
}

std::string lines_of(const std::vector<Check>& checks) {
    std::string text;
    for (const Check& check : checks) text += text_of(check) + "\n";
    return text;
}

std::string report_of(const ImportedLumen& imported, const std::filesystem::path& file,
                      const std::string& scenario) {
    std::string text;
    for (const Finding& finding : imported.findings) text += text_of(finding) + "\n";
    text += "\n" + lines_of(imported.checks);
    const Anatomy& anatomy = imported.anatomy;
    std::size_t width = 4;
    for (const auto& branch : anatomy.branches) width = std::max(width, branch.name.size());
    for (const VesselEnd& end : anatomy.ends) width = std::max(width, end.opening.name.size());
    text += fmt::format("\n{} branches:\n", anatomy.branches.size());
    for (const auto& branch : anatomy.branches) {
        const auto [least, most] = std::minmax_element(branch.radii.begin(), branch.radii.end());
        text += fmt::format("  {:<{}} {:>7.1f} mm, radius {:.2f} to {:.2f}, from {}\n", branch.name, width,
                            geometry::length_of(branch.points), *least, *most,
                            branch.parent < 0 ? "the inlet" : anatomy.branches[branch.parent].name);
    }
    text += fmt::format("{} ends:\n", anatomy.ends.size());
    for (const VesselEnd& end : anatomy.ends) {
        text += fmt::format("  {:<{}} {}, radius {:.2f} mm{}\n", end.opening.name, width,
                            io::place_text(end.opening.centre), end.opening.radius,
                            end.role == EndRole::Inlet ? ", inlet" : "");
    }
    text += "\n" + organs_text(anatomy) + "\n" + summary_of(imported.findings) + "\n";
    return text + fmt::format("\n{}: names may be edited. A scenario to begin with:\n\n", file.string()) +
           scenario;
}

/// How a scenario in that file names another, so that both can be moved together; one that is printed alone
/// names it wherever it is saved.
std::filesystem::path named_from(const std::filesystem::path& scenario, const std::filesystem::path& file) {
    namespace fs = std::filesystem;
    if (scenario.empty()) return fs::absolute(file).lexically_normal();
    return fs::relative(file, fs::absolute(scenario).parent_path());
}

/// As it would be typed again.
std::string frame_text(const FileFrame& frame, const std::string& axes) {
    std::string text = "axes " + axes;
    if (frame.scale != 1) text += ", scale " + io::number_text(frame.scale);
    for (const std::string& turn : frame.rotations) text += ", rotate " + turn;
    return text;
}

/// Before any work: it is written last.
void check_scenario_file(const ImportRequest& request) {
    if (request.scenario.empty()) return;
    try {
        io::require_writable(request.scenario);
    } catch (const io::InputError& error) {
        throw io::InputError("--scenario {}; expected a file in a folder that can be written", error.what());
    }
}

/// No output is one of the inputs.
void check_outputs(const ImportRequest& request, const std::string& name) {
    std::vector<io::Output> outputs;
    for (const char* ending : {".stl", ".anatomy.json"})
        outputs.push_back({"--out", request.out / (name + ending)});
    if (!request.scenario.empty()) outputs.push_back({"--scenario", request.scenario});
    std::vector<std::filesystem::path> inputs = request.options.centrelines;
    if (!request.mesh.empty()) inputs.push_back(request.mesh);
    inputs.insert(inputs.end(), request.mask.masks.begin(), request.mask.masks.end());
    if (!request.mask.ct.empty()) inputs.push_back(request.mask.ct);
    inputs.insert(inputs.end(), request.options.places.begin(), request.options.places.end());
    if (!request.view.empty()) inputs.push_back(request.view);
    io::require_distinct(outputs, inputs);
}

Provenance provenance_of(const ImportRequest& request, const std::string& axes) {
    Provenance made = {{"source", "imported"},
                       {"program", request.program},
                       {"mesh", request.mesh.filename().string()},
                       {"unit", request.options.unit},
                       {"frame", frame_text(request.options.frame, axes)}};
    if (request.mesh.empty()) {
        std::vector<std::string> masks;
        for (const std::filesystem::path& file : request.mask.masks)
            masks.push_back(file.filename().string());
        made[2] = {"mask",
                   masks.empty() ? "contrast of " + request.mask.ct.filename().string() : io::joined(masks)};
        made[3] = {"unit", "mm"};
        if (!request.mask.labels.empty()) made.emplace_back("labels", io::joined(request.mask.labels));
    }
    std::vector<std::string> lines, names;
    for (const std::filesystem::path& file : request.options.centrelines)
        lines.push_back(file.filename().string());
    if (!lines.empty()) made.emplace_back("centrelines", io::joined(lines));
    for (const NamedPlace& place : request.options.names)
        names.push_back(fmt::format("{} at {}", place.name, io::place_text(place.at)));
    if (!names.empty()) made.emplace_back("names", io::joined(names));
    return made;
}

}  // namespace

std::span<const FirstWire> first_wires() {
    return wires;
}

std::string first_scenario(const Anatomy& anatomy, const std::filesystem::path& file,
                           const std::filesystem::path& ct, const std::string& series,
                           const std::optional<render::CArm>& view) {
    int entry = 0;
    for (int e = static_cast<int>(anatomy.ends.size()); e-- > 0;)
        if (anatomy.ends[e].role == EndRole::Inlet) entry = e;
    const EntryPath path = path_from(anatomy, entry);
    const std::vector<double> paths = geometry::arc_lengths(path.points);
    const VesselTarget& target = anatomy.targets.front();
    // The way in may leave for the target's branch before its own end.
    std::size_t last = 0;
    for (std::size_t i = 1; i < paths.size(); ++i)
        if ((path.points[i] - target.centre).norm() < (path.points[last] - target.centre).norm()) last = i;
    last = std::max<std::size_t>(last, 1);
    double narrowest =
        *std::min_element(path.radii.begin(), path.radii.begin() + static_cast<std::ptrdiff_t>(last) + 1);
    const auto& branch = anatomy.branches[target.branch].radii;
    if ((path.points[last] - target.centre).norm() > path.radii[last])
        narrowest =
            std::min(narrowest, *std::min_element(branch.begin(), branch.begin() + target.sample + 1));
    const double room = 0.95 * paths.back();
    const FirstWire& wire = wire_for(narrowest, room);
    const double inserted =
        std::clamp(std::floor(inserted_fraction * paths[last]), std::min(wire.least_inserted, paths.back()),
                   std::max(most_inserted, wire.least_inserted));
    const auto at = std::ranges::lower_bound(paths, inserted) - paths.begin();
    const Vec3 tip = path.points[std::min<std::size_t>(static_cast<std::size_t>(at), path.points.size() - 1)];
    Eigen::AlignedBox3d box(tip);
    box.extend(path.points.front());
    box.extend(target.centre);
    const bool all_in_view = std::max(box.sizes().x(), box.sizes().z()) <= field;
    const Vec3 isocentre = view ? view->isocentre : all_in_view ? Vec3(box.center()) : tip;
    std::string pose;
    if (view)
        pose = fmt::format("lao_deg = {}\ncranial_deg = {}\nsid_mm = {}\nsod_mm = {}\n",
                           decimal(degrees(view->lao)), decimal(degrees(view->cranial)), decimal(view->sid),
                           decimal(view->sod));

    std::string text = fmt::format(
        "schema = 1\ntitle = {}\nanatomy = {}\n\n[entry]\nend = {}\ninserted_mm = {}\n\n"
        "[guidewire]\ndevice = \"{}\"{}\n\n[target]\nname = {}\nradius_mm = {}\n\n"
        "[c_arm]\n{}isocentre_mm = [{}, {}, {}]\n",
        io::toml_text(anatomy.name), io::toml_text(file.string()),
        io::toml_text(anatomy.ends[entry].opening.name), decimal(inserted), wire.name,
        wire.diameter < 2 * narrowest
            ? ""
            : fmt::format("  # does not pass {:.2f} mm, the narrowest place on the way", 2 * narrowest),
        io::toml_text(target.name), decimal(std::clamp(branch[target.sample], 1.0, 5.0)), pose,
        decimal(isocentre.x()), decimal(isocentre.y()), decimal(isocentre.z()));
    if (const std::string obstacle = obstacle_to_field(anatomy, 0.5 * wire.diameter); !obstacle.empty())
        text += fmt::format("\n[wall]\nmodel = \"mesh\"  # no smooth wall: {}\n", obstacle);
    if (!ct.empty())
        text += fmt::format("\n[patient]\nct = {}\n{}", io::toml_text(ct.string()),
                            series.empty() ? "" : fmt::format("series = {}\n", io::toml_text(series)));
    else if (!anatomy.body)
        text +=
            "\n[imaging]\npatient = false  # where in a body this is was not said: anatomy import --body\n";
    return text;
}

render::CArm load_view(const std::filesystem::path& path) {
    constexpr const char* expected =
        "expected points of 3D Slicer (.mrk.json): the focal spot, the isocentre and the middle of the "
        "detector, or "
        "the first and the last of these";
    const GivenPlaces read = load_places(path);
    const std::string file = path.string();
    if (read.places.size() != 2 && read.places.size() != 3)
        throw io::InputError("{}: {} points were found; {}", file, read.places.size(), expected);
    const TakenAxes axes = taken_axes(file, read.axes, {}, {});
    const geometry::Mat3 matrix = to_patient({}, axes.axes);
    const Vec3 source = matrix * read.places.front().second, detector = matrix * read.places.back().second;
    render::CArm arm;
    arm.sid = (detector - source).norm();
    if (!(arm.sid >= render::ArmLimits::sid.least && arm.sid <= render::ArmLimits::sid.most))
        throw io::InputError(
            "{}: {:.4g} mm from the focal spot to the detector were found; expected {:g} to {:g}", file,
            arm.sid, render::ArmLimits::sid.least, render::ArmLimits::sid.most);
    const Vec3 beam = (detector - source) / arm.sid;
    arm.lao = geometry::atan2(beam.x(), -beam.y());
    arm.cranial = geometry::asin(std::clamp(beam.z(), -1.0, 1.0));
    if (read.places.size() == 3) arm.sod = (matrix * read.places[1].second - source).dot(beam);
    arm.isocentre = source + arm.sod * beam;
    constexpr double aside = 5;  // by hand the three are not quite in line [mm]
    if (const double off = (matrix * read.places[read.places.size() / 2].second - arm.isocentre).norm();
        read.places.size() == 3 && off > aside)
        throw io::InputError(
            "{}: the isocentre lies {:.4g} mm beside the line from the focal spot to the detector; "
            "expected at most {:g}",
            file, off, aside);
    if (!(arm.sod >= render::ArmLimits::sod.least &&
          arm.sod <= std::min(arm.sid, render::ArmLimits::sod.most)))
        throw io::InputError(
            "{}: {:.4g} mm from the focal spot to the isocentre were found; expected {:g} to {:g}", file,
            arm.sod, render::ArmLimits::sod.least, std::min(arm.sid, render::ArmLimits::sod.most));
    for (const auto& [name, angle, limits] :
         {std::tuple("LAO", degrees(arm.lao), render::ArmLimits::lao),
          std::tuple("cranial", degrees(arm.cranial), render::ArmLimits::cranial)})
        if (!(angle >= limits.least && angle <= limits.most))
            throw io::InputError("{}: the detector stands at {} {:.4g}°; expected {:g} to {:g}", file, name,
                                 angle, limits.least, limits.most);
    return arm;
}

ImportOutcome run_import(const ImportRequest& given) {
    ImportRequest request = given;
    std::optional<render::CArm> view;
    if (!request.view.empty()) view = load_view(request.view);
    const MaskSource& mask = request.mask;
    const std::filesystem::path& source = !request.mesh.empty() ? request.mesh
                                          : mask.masks.empty()  ? mask.ct
                                                                : mask.masks[0];
    const std::string name = request.name.empty() ? stem_of_mask(source) : request.name;
    check_anatomy_name(name);
    if (request.scenario.empty() && !mask.ct.empty()) request.scenario = request.out / (name + ".toml");
    if (std::error_code none;
        !request.mesh.empty() &&
        std::filesystem::equivalent(request.out / (name + ".stl"), request.mesh, none)) {
        throw io::InputError(request.mesh.string() +
                             ": would be overwritten; expected another folder or another name (--name)");
    }
    check_outputs(request, name);
    if (!given.scenario.empty()) check_scenario_file(request);
    if (!request.body.empty()) landmark_of_part(request.body);
    if (request.landmark && request.body.empty())
        throw io::InputError("--landmark was given without --body; expected both");
    const io::OwnFolder own(request.out, name);
    for (const char* ending : {".stl", ".anatomy.json"}) io::require_writable(request.out / (name + ending));
    if (given.scenario.empty()) check_scenario_file(request);
    ImportedLumen imported = request.mesh.empty() ? import_mask(mask, request.options)
                                                  : import_lumen(request.mesh, request.options);
    if (!request.mesh.empty() && !mask.ct.empty()) {
        if (request.options.progress) request.options.progress(0.97, "reading the CT");
        for (Finding& finding :
             compare_with_ct(imported.anatomy.lumen, patient::read_ct(mask.ct, mask.series), mask.ct))
            imported.findings.push_back(std::move(finding));
    }
    imported.anatomy.name = name;
    if (!request.body.empty())
        imported.findings.push_back(
            {Finding::Kind::Noted, place_in_part(imported.anatomy, request.body, request.landmark)});
    ImportOutcome outcome;
    outcome.file = write_anatomy(imported.anatomy, request.out, provenance_of(request, imported.axes));
    const std::string scenario = first_scenario(
        imported.anatomy, named_from(request.scenario, outcome.file),
        mask.ct.empty() ? std::filesystem::path() : named_from(request.scenario, mask.ct), mask.series, view);
    outcome.report = report_of(imported, outcome.file, scenario);
    if (!request.scenario.empty()) io::write_whole(request.scenario, scenario);
    return outcome;
}

CheckOutcome run_check(const std::filesystem::path& anatomy) {
    const Anatomy loaded = load_anatomy(anatomy);
    const std::vector<Check> checks = anatomy_checks(loaded);
    CheckOutcome outcome{lines_of(checks) + organs_text(loaded), true};
    for (const Check& check : checks) outcome.fine = outcome.fine && check.verdict != Check::Verdict::Fail;
    return outcome;
}

}  // namespace anatomy
