#pragma once
/// `seldinger anatomy …`: vessels from presets, files and meshes.

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "engine/anatomy/generate_run.h"
#include "engine/anatomy/import_run.h"

namespace app {

class AnatomyCommand {
public:
    /// Adds the sub-command; lives as long as it.
    explicit AnatomyCommand(CLI::App&);
    bool given() const { return command_->parsed(); }
    /// Exit code, 0 or of a check that failed 2; throws engine::InputError.
    int run();

private:
    void add_generate();
    void add_import();
    void add_check();
    int generate();
    int import();
    int check() const;

    CLI::App *command_, *generate_ = nullptr, *import_ = nullptr, *check_ = nullptr;
    engine::GenerateRequest request_;
    std::vector<std::string> stenoses_, aneurysms_, tortuosities_;
    engine::ImportRequest import_request_;
    std::vector<double> inlet_;
    std::string checked_;
};

}  // namespace app
