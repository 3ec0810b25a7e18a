/// `seldinger relax`.

#include <fmt/format.h>
#include <memory>
#include <string>

#include "app/command.h"
#include "app/progress_bar.h"
#include "engine/run/relax_method.h"
#include "engine/run/relax_run.h"

namespace app {
namespace {

int relax_wire(run::RelaxRequest request, const run::RelaxFiles& files) {
    run::check_files(files, request);
    const bool planes = request.wall == "mesh" && request.method == "global";
    run::RelaxOutcome outcome;
    {
        ProgressBar bar;
        report_on(bar, request.cache);
        if (request.cache.folder.empty()) request.cache.folder = anatomy::cache_beside(files.joints);
        outcome = run::run_relax(run::make_relax_case(request), [&bar](const run::RelaxProgress& p) {
            bar.show(p.part, fmt::format("{} segments  |g|/C {:.1e}", p.segments, p.gradient));
        });
    }
    run::write_files(files, outcome);
    print("{}: {} segments, energy {:.8g} N·mm, |g|/C {:.1e} ({}), {} contacts, {:.3g} s\n", outcome.method,
          outcome.wire.segments(), outcome.energy.total(), outcome.gradient,
          !outcome.converged && planes ? "as near to rest as the mesh's planes let it"
          : !outcome.converged         ? "not converged"
          : outcome.counts_newton_steps && !outcome.strict_minimum ? "converged, not at a strict minimum"
                                                                   : "converged",
          outcome.contacts, outcome.cpu);
    return 0;
}

}  // namespace

Command add_relax(CLI::App& parser) {
    const auto request = std::make_shared<run::RelaxRequest>();
    const auto files = std::make_shared<run::RelaxFiles>();
    CLI::App* command = parser.add_subcommand(
        "relax",
        "Relax one wire in one vessel from numbers in files\n\n"
        "Example:\n"
        "  seldinger relax --tube tube.csv --radius 3 --segments 100 --segment-length 2 --rigidity 50 \\\n"
        "    --wall-stiffness 1 --method global --out joints.csv --report report.json");
    add_optional(command, "--tube", request->tube, "CSV of a tube's centreline (x_mm,y_mm,z_mm)")
        ->type_name("FILE");
    add_optional(command, "--radius", request->radius, "Radius of the tube [mm]");
    add_optional(command, "--anatomy", request->anatomy, "NAME.anatomy.json, instead of a tube")
        ->type_name("FILE");
    add_optional(command, "--branch", request->branch, "Branch by whose open end the wire enters")
        ->type_name("NAME");
    command->add_option("--wall", request->wall, "Of an anatomy: distance-field, or mesh, the paper's planes")
        ->check(one_of({"distance-field", "mesh"}));
    command
        ->add_option("--cache", request->cache.folder,
                     "Folder that keeps distance fields; else cache beside --out")
        ->type_name("FOLDER");
    add_optional(command, "--wire", request->wire, "CSV of the wire's joints, from joint 0")
        ->type_name("FILE");
    add_optional(command, "--segments", request->segments, "Segments of a wire laid along the centreline");
    add_optional(command, "--segment-length", request->segment_length, "Their length [mm]");
    command->add_option("--wire-diameter", request->wire_diameter, "Taken off the lumen's [mm]; 0 = a line");
    add_optional(command, "--entry-direction", request->entry_direction,
                 "X,Y,Z; else along the first segment")
        ->type_name("X,Y,Z");
    command->add_option("--rigidity", request->rigidity, "EI [N·mm²]")->required();
    command
        ->add_option("--clamp", request->clamp,
                     "What the first and the last joint stand for: half of a segment (second order in "
                     "its length), or paper, a whole one")
        ->type_name("CLAMP");
    add_optional(command, "--load", request->load,
                 "X,Y,Z, force on the wire per length, as its weight [N/mm]")
        ->type_name("X,Y,Z");
    command->add_option("--wall-stiffness", request->wall_stiffness, "k of each joint [N/mm]")->required();
    add_optional(command, "--wall-variation", request->wall_variation,
                 "Eq. 41, a wall not as stiff everywhere: a seed that draws nine terms as the paper does, or "
                 "a CSV of terms (amplitude_share,phase_deg)")
        ->type_name("SEED or FILE");
    add_optional(command, "--wall-variation-length", request->wall_variation_length,
                 "Way along the vessels over which it varies [mm]; else their longest way from the root");
    command->add_option("--method", request->method, "Method of relaxation, see below")
        ->required()
        ->type_name("METHOD");
    add_optional(command, "--cycles", request->cycles,
                 "Most relaxation cycles, 300 (with --push-from: 10 a push, but of the global method 300)");
    add_optional(command, "--tolerance", request->tolerance, "Stop once |gradient| over C is no larger");
    add_optional(command, "--push-from", request->push_from,
                 "Start with so many segments and insert the rest one by one (push.csv beside --out)");
    command->add_option("--out", files->joints, "CSV for the joints")->required()->type_name("FILE");
    command->add_option("--report", files->report, "JSON for energy, gradient, contacts, work, time")
        ->required()
        ->type_name("FILE");
    command->footer(std::string(run::method_words) +
                    "Exit codes: 0 done (the report says whether it converged), 2 bad input.");
    return {command, [request, files] { return relax_wire(*request, *files); }};
}

}  // namespace app
