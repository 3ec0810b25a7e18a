/// The command line: takes arguments, returns an exit code. Contains no rule of the simulation.

#include "app/command.h"

int main(int count, char** values) {
    app::catch_signals();
    CLI::App parser("Guidewire training simulator", "seldinger");
    parser.set_version_flag("--version", app::program);
    parser.require_subcommand(1);
    const app::Command commands[] = {
        app::add_run(parser),      app::add_play(parser),   app::add_score(parser), app::add_replay(parser),
        app::add_debrief(parser),  app::add_course(parser), app::add_batch(parser), app::add_show(parser),
        app::add_list(parser),     app::add_device(parser), app::add_relax(parser), app::add_render(parser),
        app::add_anatomy(parser),  app::add_study(parser),  app::add_cache(parser), app::add_serve(parser),
        app::add_bake(parser),     app::add_check(parser),  app::add_new(parser),   app::add_author(parser),
        app::add_benchmark(parser)};
    parser.footer(commands[0].parser->get_footer());
    return app::run_action(parser, count, values, [&]() -> int {
        for (const app::Command& command : commands)
            if (*command.parser) return command.action();
        return app::bad_input;
    });
}
