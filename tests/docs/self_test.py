#!/usr/bin/env python3
"""Tests the document checks on small synthetic repositories."""
import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import unittest

from check_documents import ROOT, check_documents, check_references

PROGRAM = ""
FENCE = "```"
DIAGRAM = '<svg xmlns="http://www.w3.org/2000/svg"><text class="module">{}</text></svg>'
SOUND = {
    "README.md": "# A\n\nSee [b](docs/b.md#second-part), ![p](docs/p.png) and `tools/x --all`.\n",
    "docs/b.md": "# B\n\n## Second part\n\n" + f"{FENCE}sh\nparhelion validate \\\n  lab.yaml  # mine\n"
                 f"./tools/x > out.txt\n{FENCE}\n",
    "docs/p.png": "",
    "docs/architecture.svg": DIAGRAM.format("protocols"),
    "tests/architecture/modules.txt": "# all\nprotocols\n",
    "protocols/README.md": "# protocols\n",
    "tools/x": "#!/bin/sh\n",
}


class DocumentChecks(unittest.TestCase):
    def setUp(self):
        self.root = tempfile.mkdtemp()
        self.addCleanup(shutil.rmtree, self.root)
        for path, text in SOUND.items():
            self.write(path, text)
        os.chmod(os.path.join(self.root, "tools/x"), 0o755)

    def write(self, path, text):
        place = os.path.join(self.root, path)
        os.makedirs(os.path.dirname(place), exist_ok=True)
        with open(place, "w", encoding="utf-8") as file:
            file.write(text)

    def problems(self):
        return list(check_documents(self.root, PROGRAM))

    def expect(self, *parts):
        """Expects exactly one problem that contains all of these."""
        found = self.problems()
        self.assertEqual(len(found), 1, found)
        for part in parts:
            self.assertIn(part, found[0])

    def write_fence(self, kind, text, path="docs/c.md"):
        self.write(path, f"# C\n\n{FENCE}{kind}\n{text}\n{FENCE}\n")

    def test_nothing_is_wrong_with_what_is_right(self):
        self.assertEqual(self.problems(), [])

    def test_diff_of_lines_that_are_there(self):
        self.write("server/a.cpp", "int first;\nint second; int third;\n")
        self.write_fence("diff", " int first;\n-int second; int third;\n+int fourth;")
        self.assertEqual(self.problems(), [])
        self.write_fence("diff", "- ... int third;\n+ ... int fourth;")
        self.assertEqual(self.problems(), [])

    def test_diff_of_lines_that_are_not_there(self):
        self.write("server/a.cpp", "int first;\nint between;\nint second;\n")
        for old in (" int other;", " int first;\n-int second;", "- ... int third;", "-int fir"):
            self.write_fence("diff", f"{old}\n+int fourth;")
            self.expect("docs/c.md:4", "in no source file")

    def test_broken_link(self):
        self.write("docs/c.md", "# C\n\nSee [d](d.md).\n")
        self.expect("docs/c.md:3", "'d.md' is not there")

    def test_broken_image(self):
        self.write("docs/c.md", '<img src="d.png">\n![d](d.png)\n[![p](p.png)](b.md)\n')
        self.assertEqual(self.problems(), ["docs/c.md:1: link 'd.png' is not there",
                                           "docs/c.md:2: link 'd.png' is not there"])

    def test_broken_anchor(self):
        self.write("docs/c.md", "# C\n\n[b](b.md#third-part)\n")
        self.expect("docs/c.md:3", "no heading '#third-part'")

    def test_link_out_of_the_repository(self):
        self.write("docs/c.md", "[x](../../x.md)\n")
        self.expect("leads out of the repository")

    def test_links_in_code_and_to_the_web_are_left_alone(self):
        self.write_fence("text", "[d](d.md)")
        self.write("docs/d.md", "`[d](e.md)` and [w](https://example.org/e.md)\n")
        self.assertEqual(self.problems(), [])

    def test_path_in_code_that_is_not_there(self):
        self.write("docs/c.md", "Run `tools/y --all`, read `protocols/*.md` and `./build/release/tools/x`.\n")
        self.expect("docs/c.md:1", "`tools/y` is not there")
        self.write("docs/c.md", "<!-- new files: tools/y -->\nWrite `tools/y`.\n")
        self.assertEqual(self.problems(), [])

    def test_unknown_command(self):
        self.write_fence("sh", "cd x && parhelion servee lab.yaml | tee log")
        self.expect("docs/c.md:4", "unknown subcommand 'servee', did you mean 'serve'?")

    def test_unknown_option(self):
        program = "build/release/tools/parhelion"
        self.write_fence("sh", f"LCM_DEFAULT_URL=memq:// {program} replay a.lcm \\\n  --outptu b.lcm &")
        self.expect("docs/c.md:4", "unknown option '--outptu'")

    def test_command_in_a_substitution_and_after_a_comment(self):
        self.write_fence("sh", "source <(parhelion completion zsh)  # 'zsh\n# parhelion nothing\n"
                               "cat <<EOF\nparhelion nothing\nEOF")
        self.expect("docs/c.md:4", "completion zsh")

    def test_command_without_a_language(self):
        self.write_fence("", "parhelion help")
        self.expect("docs/c.md:4", "without a language")

    def test_short_command_that_fails(self):
        self.write("lab.yaml", "level: 7\n")
        self.expect("docs/b.md:6", "level <= 3")

    def test_missing_script(self):
        self.write_fence("sh", "c++ b.cpp -o b && ./b\n./tools/y --all")
        self.expect("docs/c.md:5", "./tools/y is not there")

    def test_missing_file_of_the_repository(self):
        self.write_fence("sh", "parhelion serve server/scenarios/lab.yaml -o docs/out.lcm")
        self.expect("docs/c.md:4", "server/scenarios/lab.yaml is not there")

    def test_invalid_yaml(self):
        self.write_fence("yaml", "name: lab\nagents: []\nlevle: 3")
        self.expect("docs/c.md:4", "unknown key 'levle', did you mean 'level'?")

    def test_fragments_and_files_of_others_are_left_alone(self):
        self.write_fence("yaml", "# fragment\nlevle: 3")
        self.write_fence("yaml", "jobs: {build: {}}", "docs/d.md")
        self.assertEqual(self.problems(), [])

    def test_files_of_one_document_refer_to_each_other(self):
        robot = "footprint: [[0 m, 0 m], [1 m, 0 m], [0 m, 1 m]]\nlaser: {preset: utm-30lx, pose: {}}"
        text = f"{FENCE}yaml\n# robot.yaml\n{robot}\n{FENCE}\n\n{FENCE}yaml\nname: lab\nrobot: robot.yaml\n{FENCE}\n"
        self.write("docs/c.md", text)
        self.assertEqual(self.problems(), [])
        self.write("docs/c.md", text.replace("# robot.yaml", "# rover.yaml"))
        self.expect("docs/c.md:8", "robot.yaml")

    def test_readme_that_is_too_long(self):
        self.write("README.md", "word " * 601)
        self.expect("README.md: 601 words, at most 600")

    def test_module_readme_that_is_too_long(self):
        self.write("protocols/yaml/README.md", "line\n" * 26)
        self.expect("protocols/yaml/README.md: 26 lines, at most 25")

    def test_diagram_that_lacks_a_module(self):
        self.write("tests/architecture/modules.txt", "protocols\nfusion/pose\n")
        self.expect("'fusion/pose' 0 times")

    def test_diagram_with_a_module_too_many(self):
        self.write("docs/architecture.svg", DIAGRAM.format("protocols").replace(
            "</svg>", '<text class="big module">render</text><text>note</text></svg>'))
        self.expect("'render', which is not in")

    def test_stale_reference(self):
        folder = os.path.join(self.root, "reference")
        subprocess.run([os.path.join(ROOT, "tools/reference"), "--program", PROGRAM, "--folder", folder], check=True,
                       stdout=subprocess.DEVNULL)
        self.assertEqual(list(check_references(ROOT, PROGRAM, folder)), [])
        with open(os.path.join(folder, "course.md"), "a", encoding="utf-8") as file:
            file.write("by hand\n")
        found = "".join(check_references(ROOT, PROGRAM, folder))
        self.assertIn("course.md is not what its sources give: run tools/reference", found)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--program", required=True, help="the built parhelion")
    known, rest = parser.parse_known_args()
    PROGRAM = os.path.abspath(known.program)
    unittest.main(argv=[sys.argv[0], *rest])
