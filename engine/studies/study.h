#pragma once
/// A study answers one question with numbers: tables, and a picture drawn from them.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/anatomy/lumen_wall.h"
#include "engine/io/csv.h"
#include "engine/io/plot.h"
#include "physics/wire/chain.h"
#include "render/picture/image.h"

namespace studies {

using geometry::Polyline;
using geometry::Vec2;
using geometry::Vec3;
using physics::Chain;

struct StudyProgress {
    int done = 0, of = 1;
    std::string what;  // what was done last
};

struct StudyOptions {
    bool quick = false;                 // shorter wires and less work: a test, not a result
    int threads = 1;                    // results do not depend on it
    std::uint64_t seed = 1;             // for studies that draw random numbers
    std::string program;                // name and version; shards of another program are not merged
    std::filesystem::path real_meshes;  // folder of meshes from elsewhere; may be missing
    std::filesystem::path scenarios;    // folder of the scenarios in the distribution; may be missing
    std::filesystem::path devices;      // folder of the devices that they name
    std::filesystem::path pictures;     // folder of PNG pictures to be measured beside; may be empty
    anatomy::ModelCache cache;          // an empty folder stands for cache beside the study's own
    std::function<void(const StudyProgress&)> progress;  // one call at a time
};

/// What a claim rests on, and so what it is worth that it holds.
enum class ClaimKind {
    Published,   // a statement of the paper that the measurement could contradict: reproduced, or differs
    Calibrated,  // a number of the paper that a scene was chosen by: it shows that such a scene exists, no
                 // more
    Identity,    // true by construction: a check of the program
    Machine,     // a processor time, which is another on every machine and every run: reported, never counted
    Extension    // not the paper's
};

/// A published figure or statement against what was measured here. Apart from times, it is the same on every
/// run. Its text identifies it within its study; no two claims of a study share a text.
struct Claim {
    std::string text;                   // where it is published and what it says, with its unit
    io::TableCell published, measured;  // number or words; a number that is not finite was not obtained
    bool holds = false;
    std::string note = {};  // where the claim fails, why and what shows it; else how it was measured
    ClaimKind kind = ClaimKind::Extension;
    std::string rule = {};    // when it holds, and so how it can fail; a published claim has one
    std::string figure = {};  // of the paper, or a section or table: claims are listed by it
};

/// What is looked at rather than plotted.
struct StudyPicture {
    std::string name, caption;  // NAME.png, and a sentence or two on what it shows
    render::GrayImage image;
};

struct StudyResult {
    std::vector<io::Table> tables;  // each is written as NAME.csv
    std::vector<io::Plot> plots;    // each reads some of the tables
    std::string page;               // Markdown, written as ID.md
    std::vector<Claim> claims;      // written as claims.json where there are any
    std::vector<std::pair<std::string, std::string>> notes =
        {};  // of a figure: what holds for all its claims
    std::vector<StudyPicture> pictures = {};
    std::vector<std::pair<std::string, std::string>> files = {};  // others: name and text

    /// Adds a claim of this project's own.
    void claim(std::string text, io::TableCell published, io::TableCell measured, bool holds,
               std::string note) {
        claims.push_back(
            {std::move(text), std::move(published), std::move(measured), holds, std::move(note)});
    }
};

/// Work of a study that can be cut into independent pieces: each gives a row of numbers.
struct PieceWork {
    int (*pieces)(const StudyOptions&);
    /// Columns of the rows, names with units; the first is the piece's number.
    std::vector<std::string> (*columns)(const StudyOptions&);
    /// Rows of the pieces first … last − 1.
    std::vector<std::vector<double>> (*rows)(const StudyOptions&, int first, int last);
    /// The result from the rows of all pieces.
    StudyResult (*finish)(const StudyOptions&, const std::vector<std::vector<double>>& rows);
};

struct Study {
    std::string_view id, question;
    StudyResult (*run)(const StudyOptions&);
    const PieceWork* in_pieces = nullptr;  // set when the study can be run in shards
};

/// All studies, in the order they are listed.
std::span<const Study> all_studies();
/// Throws InputError listing the studies that exist.
const Study& find_study(std::string_view id);

/// Runs the study and writes its files to the folder, which it creates. Returns notices, such as a missing
/// picture. Throws InputError; for a folder that cannot be written, before any work.
std::vector<std::string> run_study(const Study&, const std::filesystem::path& out, const StudyOptions&);

/// Runs every study into a folder of its name, and writes index.html with all pictures and claims, and the
/// claims as claims.json. Returns notices; throws as run_study does.
std::vector<std::string> run_all_studies(const std::filesystem::path& out, const StudyOptions&);

}  // namespace studies
