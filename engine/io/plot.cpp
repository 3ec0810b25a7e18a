#include "engine/io/plot.h"

#include <array>
#include <cstdlib>
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

#include "engine/io/files.h"

namespace io {
namespace {

/// Runs gnuplot on the script in its folder and returns its exit code; 127 when there is no gnuplot.
int run_gnuplot(const std::filesystem::path& folder, const std::string& script) {
    const std::string place = folder.string();
    const pid_t process = ::fork();
    if (process < 0) return 127;
    if (process == 0) {
        // Only calls that are safe between fork and exec.
        const int nowhere = ::open("/dev/null", O_RDWR | O_CLOEXEC);
        if (nowhere >= 0) {
            ::dup2(nowhere, STDIN_FILENO);
            ::dup2(nowhere, STDOUT_FILENO);
            ::dup2(nowhere, STDERR_FILENO);
        }
        if (::chdir(place.c_str()) != 0) ::_exit(126);
        ::execlp("gnuplot", "gnuplot", script.c_str(), static_cast<char*>(nullptr));
        ::_exit(127);
    }
    int status = 0;
    while (::waitpid(process, &status, 0) < 0 && errno == EINTR) {
    }
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128;
}

}  // namespace

std::string plot_script(const Plot& plot) {
    std::string text = "# gnuplot " + plot.name + ".gp, in this folder, draws the picture again.\n";
    const std::array<std::array<std::string, 2>, 2> formats = {
        {{"svg", "svg size {},{} font 'DejaVu Sans,12' background rgb 'white'"},
         {"png", "pngcairo size {},{} font 'DejaVu Sans,10' background rgb 'white'"}}};
    for (const auto& [extension, terminal] : formats) {
        text += "\nreset\nset datafile separator ','\nset terminal " +
                fmt::format(fmt::runtime(terminal), plot.width, plot.height) + "\nset output '" + plot.name +
                "." + extension + "'\n" + plot.commands + "unset output\n";
    }
    return text;
}

std::string write_plot(const Plot& plot, const std::filesystem::path& folder) {
    const std::string script = plot.name + ".gp";
    write_whole(folder / script, plot_script(plot));
    const int code = run_gnuplot(folder, script);
    if (code == 0) return "";
    if (code == 127) return fmt::format("{}: no picture, for gnuplot is not installed", script);
    return fmt::format("{}: gnuplot failed with code {}; there may be no picture", script, code);
}

}  // namespace io
