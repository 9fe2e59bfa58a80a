#include <iostream>

#include "paper/page.h"
#include "report/progress.h"
#include "tools/commands.h"

namespace emtb {

void add_paper_command(CommandLine& line) {
  struct Options {
    std::string out = "docs", sessions;
  };
  const auto o = std::make_shared<Options>();
  line.command("paper", "repeats the paper's experiments on the simulated bench and writes a page about them")
      .option("--out", o->out, "the folder of paper.md and pictures/paper/; without it docs")
      .option("--sessions", o->sessions, "writes the experiments' sessions into this folder, for emtb estimate")
      .action([o] {
        Progress progress;
        const paper::Findings findings =
            paper::find([&](double share, const std::string& doing) { progress.show(share, doing); });
        progress.clear();
        paper::write_page(findings, o->out);
        std::cout << (std::filesystem::path(o->out) / "paper.md").string() << "\n";
        if (!o->sessions.empty()) {
          for (const auto& file : paper::write_sessions(findings, o->sessions)) std::cout << file.string() << "\n";
        }
        return 0;
      });
}

}  // namespace emtb
