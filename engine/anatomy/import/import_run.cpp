#include "engine/anatomy/import/import_run.h"

#include <fmt/format.h>

#include "engine/anatomy/anatomy_writer.h"
#include "engine/io/error.h"
#include "engine/io/text.h"
#include "physics/geometry/polyline.h"

namespace anatomy {
namespace {

std::string lines_of(const std::vector<Check>& checks) {
    std::string text;
    for (const Check& check : checks) text += text_of(check) + "\n";
    return text;
}

std::string report_of(const ImportedLumen& imported, const std::filesystem::path& file) {
    std::string text;
    for (const Finding& finding : imported.findings) text += text_of(finding) + "\n";
    text += "\n" + lines_of(imported.checks);
    const Anatomy& anatomy = imported.anatomy;
    text += fmt::format("\n{} branches:\n", anatomy.branches.size());
    for (const auto& branch : anatomy.branches) {
        const auto [least, most] = std::minmax_element(branch.radii.begin(), branch.radii.end());
        text += fmt::format("  {:<4} {:>7.1f} mm, radius {:.2f} to {:.2f}, from {}\n", branch.name,
                            geometry::length_of(branch.points), *least, *most,
                            branch.parent < 0 ? "the inlet" : anatomy.branches[branch.parent].name);
    }
    text += fmt::format("{} ends:\n", anatomy.ends.size());
    for (const VesselEnd& end : anatomy.ends) {
        text += fmt::format("  {:<6} {}, radius {:.2f} mm{}\n", end.opening.name,
                            io::place_text(end.opening.centre), end.opening.radius,
                            end.role == EndRole::Inlet ? ", inlet" : "");
    }
    return text + fmt::format(
                      "\n{}: names may be edited. A scenario uses it by\nanatomy = \"{}\"\nentry.end = "
                      "\"{}\"\ntarget.name = \"{}\"\n",
                      file.string(), std::filesystem::absolute(file).lexically_normal().string(),
                      anatomy.ends[0].opening.name, anatomy.targets[0].name);
}

}  // namespace

ImportOutcome run_import(const ImportRequest& request) {
    const std::string name = request.name.empty() ? request.mesh.stem().string() : request.name;
    check_anatomy_name(name);
    if (std::error_code none;
        std::filesystem::equivalent(request.out / (name + ".stl"), request.mesh, none)) {
        throw io::InputError(request.mesh.string() +
                             ": would be overwritten; another folder or another name (--name) is accepted");
    }
    const bool fresh = !std::filesystem::exists(request.out);
    check_anatomy_folder(request.out);
    ImportedLumen imported;
    try {
        imported = import_lumen(request.mesh, request.options);
    } catch (...) {
        std::error_code ignored;
        if (fresh) std::filesystem::remove(request.out, ignored);
        throw;
    }
    imported.anatomy.name = name;
    Provenance made = {{"source", "imported"},
                       {"program", request.program},
                       {"mesh", request.mesh.filename().string()},
                       {"unit", request.options.unit}};
    if (!request.options.centrelines.empty())
        made.emplace_back("centrelines", request.options.centrelines.filename().string());
    ImportOutcome outcome;
    outcome.file = write_anatomy(imported.anatomy, request.out, made);
    outcome.report = report_of(imported, outcome.file);
    return outcome;
}

CheckOutcome run_check(const std::filesystem::path& anatomy) {
    const std::vector<Check> checks = anatomy_checks(load_anatomy(anatomy));
    CheckOutcome outcome{lines_of(checks), true};
    for (const Check& check : checks) outcome.fine = outcome.fine && check.verdict != Check::Verdict::Fail;
    return outcome;
}

}  // namespace anatomy
