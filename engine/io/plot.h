#pragma once
/// Pictures drawn by gnuplot from CSV files.

#include <filesystem>
#include <string>

namespace io {

struct Plot {
    std::string name;               // NAME.gp, NAME.svg, NAME.png
    std::string commands;           // gnuplot's, without terminal and output; run once for each format
    int width = 900, height = 600;  // [pixels]
    std::string caption = {};       // a sentence or two on what it shows, for a page

    /// Adds a curve to the "plot " that the commands end with.
    void curve(const std::string& text) {
        commands += (commands.ends_with("plot ") ? "" : ", \\\n     ") + text;
    }
};

/// The script as written to the file: readers can change it and run `gnuplot NAME.gp` in its folder.
std::string plot_script(const Plot&);

/// Writes NAME.gp and, where gnuplot is installed, has it draw NAME.svg and NAME.png. Returns an empty text,
/// or the reason why there is no picture. Throws InputError when the script cannot be written.
std::string write_plot(const Plot&, const std::filesystem::path& folder);

}  // namespace io
