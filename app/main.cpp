/// The command line: takes arguments, returns an exit code. Contains no rule of the simulation.

#include <utility>
#include <vector>

#include "app/command.h"

int main(int count, char** values) {
    app::catch_signals();
    CLI::App parser(
        "Seldinger, a training simulator for guidewires and catheters\n\n"
        "Examples:\n"
        "  seldinger play                       choose an exercise, in a window\n"
        "  seldinger list                       the exercises\n"
        "  seldinger run straight --commands solution --out hello\n"
        "  seldinger help run                   what one command takes",
        "seldinger");
    parser.require_subcommand(1);
    using Add = app::Command (*)(CLI::App&);
    const std::pair<const char*, std::vector<Add>> groups[] = {
        {"Train", {app::add_play, app::add_list, app::add_show, app::add_score, app::add_debrief}},
        {"Teach", {app::add_course, app::add_benchmark}},
        {"Make exercises",
         {app::add_new, app::add_check, app::add_author, app::add_plan, app::add_device, app::add_anatomy}},
        {"Run without a window",
         {app::add_run, app::add_replay, app::add_batch, app::add_render, app::add_views, app::add_serve,
          app::add_bake, app::add_cache}},
        {"Study the method", {app::add_study, app::add_relax}},
        {"Help", {app::add_help, app::add_version, app::add_completion}}};
    std::vector<app::Command> commands;
    for (const auto& [group, all] : groups)
        for (const Add add : all) {
            commands.push_back(add(parser));
            commands.back().parser->group(group);
        }
    parser.footer("Exit codes: 0 done, 1 not all of it, 2 bad input, 3 something differs, 130 interrupted.");
    return app::run_action(parser, count, values, [&]() -> int {
        for (const app::Command& command : commands)
            if (*command.parser) return command.action();
        return app::bad_input;
    });
}
