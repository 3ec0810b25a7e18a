#include "app/study_arguments.h"

namespace app {

const char* const study_description =
    "Run a study, or without an ID list them\n\n"
    "Examples:\n"
    "  seldinger study                                     the studies and their questions\n"
    "  seldinger study accuracy --quick --out study        one of them, as a try\n"
    "  seldinger study all --out studies                   all, on one page";

void add_study_arguments(CLI::App& parser, StudyArguments& arguments) {
    parser.add_option("id", arguments.id, "Which study, or 'all', or 'merge'")->type_name("STUDY");
    parser.add_option("folders", arguments.folders, "Of 'merge': those that --shard left")
        ->type_name("FOLDER");
    parser.add_option("--out", arguments.out, "Folder for tables and pictures")->type_name("FOLDER");
    parser.add_flag("--quick", arguments.quick, "Shorter wires, less work: a try, not a result");
    parser.add_option("--threads", arguments.threads, "Threads; results do not depend on them")
        ->check(whole_number(1, 256));
    add_optional(&parser, "--shard", arguments.shard,
                 "The i-th of n equal parts, for 'merge' (wall-variation)")
        ->type_name("i/n")
        ->check(shard());
    parser
        .add_option("--pictures", arguments.pictures,
                    "Of 'realism': other pictures, NAME_0.4mm.png, to measure beside")
        ->type_name("FOLDER");
    parser.add_option("--seed", arguments.seed, "Of a study that draws random numbers");
    parser.footer("Exit codes: 0 done, 2 bad input, 130 interrupted.");
}

}  // namespace app
