#include "engine/io/plot.h"

#include <array>
#include <cerrno>
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

/// The script, with its pictures in a folder that ends in "/", or in its own.
std::string script_into(const Plot& plot, const std::string& folder) {
    std::string text = "# gnuplot " + plot.name + ".gp, in this folder, draws the picture again.\n";
    const std::array<std::array<std::string, 2>, 2> formats = {
        {{"svg", "svg size {},{} font 'DejaVu Sans,12' background rgb 'white'"},
         {"png", "pngcairo size {},{} font 'DejaVu Sans,10' background rgb 'white'"}}};
    for (const auto& [extension, terminal] : formats) {
        text += "\nreset\nset datafile separator ','\nset terminal " +
                fmt::format(fmt::runtime(terminal), plot.width, plot.height) + "\nset output '" + folder +
                plot.name + "." + extension + "'\n" + plot.commands + "unset output\n";
    }
    return text;
}

/// As gnuplot takes it within single quotes.
std::string in_single_quotes(const std::string& text) {
    std::string result;
    for (const char c : text) result += c == '\'' ? std::string("''") : std::string(1, c);
    return result;
}

}  // namespace

std::string plot_script(const Plot& plot) {
    return script_into(plot, "");
}

std::string write_plot(const Plot& plot, const std::filesystem::path& folder) {
    const std::string script = plot.name + ".gp";
    write_whole(folder / script, plot_script(plot));
    // Drawn elsewhere and moved, so that a picture is whole or absent.
    const ScratchFolder scratch(std::filesystem::absolute(folder) / plot.name);
    const std::filesystem::path drawing = scratch.path() / script;
    write_whole(drawing, script_into(plot, in_single_quotes(scratch.path().string()) + "/"));
    const int code = run_gnuplot(folder, drawing.string());
    if (code == 0) {
        std::error_code failed;
        for (const char* ending : {".svg", ".png"})
            if (!failed)
                std::filesystem::rename(scratch.path() / (plot.name + ending), folder / (plot.name + ending),
                                        failed);
        return failed ? fmt::format("{}: no picture: {}", script, failed.message()) : "";
    }
    if (code == 127) return fmt::format("{}: no picture, for gnuplot is not installed", script);
    return fmt::format("{}: gnuplot failed with code {}; there is no picture", script, code);
}

}  // namespace io
