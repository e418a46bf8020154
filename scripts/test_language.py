"""Tests of `language.py`: each rule on a sentence that breaks it and on one that does not."""

import contextlib
import io
import sys
import tempfile
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import language


def problems(text, readme=False):
    """The findings of a text as `line: problem`."""
    return [f"{found.line}: {found.problem}" for found in language.check(text, readme)]


def sentence_of(count):
    """A sentence of so many words."""
    return "Word" + " word" * (count - 1) + "."


class Sentences(unittest.TestCase):
    def test_twenty_five_words_pass_and_twenty_six_do_not(self):
        self.assertEqual(problems(sentence_of(25)), [])
        self.assertEqual(len(problems(sentence_of(26))), 1)
        self.assertIn("26 words", problems(sentence_of(26))[0])

    def test_a_sentence_ends_at_its_full_stop_and_not_within_a_number(self):
        self.assertEqual(problems(f"{sentence_of(20)}\n{sentence_of(20)}"), [])
        rest = "word " * 22 + "end."
        self.assertIn("27 words", problems(f"The value 0.5 of {rest}")[0])
        self.assertIn("29 words", problems(f"See Liu et al. Value of\n{rest}")[0])

    def test_a_finding_names_the_line_on_which_its_sentence_begins(self):
        text = f"First line.\nSecond. {sentence_of(26).replace(' ', chr(10), 3)}\n"
        self.assertTrue(problems(text)[0].startswith("2: "), problems(text))

    def test_points_of_a_list_are_apart(self):
        long = " ".join(["word"] * 20)
        self.assertEqual(problems(f"* {long}\n* {long}\n  {' '.join(['word'] * 5)}\n"), [])
        self.assertEqual(len(problems(f"* {long}\n  {long}\n")), 1)

    def test_inline_code_and_a_link_count_by_their_text(self):
        words = " ".join(["word"] * 23)
        self.assertEqual(problems(f"{words} `a b c d e` end."), [])
        self.assertEqual(problems(f"{words} [two words](an/address/that/has/many parts)."), [])
        self.assertEqual(problems(f"{words} ``a ` tick`` end."), [])


class Will(unittest.TestCase):
    def test_things_do_not_want(self):
        for wrong in [
            "The field wants a weight.",
            "This tells the side.",
            "The loss asks for rigid parts.",
            "No method knows them.",
            "The model is told the times.",
            "Points miss themselves there.",
            "Time at a fair price.",
            "A punished bound.",
        ]:
            self.assertNotEqual(problems(wrong), [], wrong)

    def test_people_may(self):
        for right in [
            "If you want volume, set it.",
            "You may also want more steps.",
            "Those who know the frames use them.",
            "You do not want this.",
        ]:
            self.assertEqual(problems(right), [], right)

    def test_code_is_not_looked_at(self):
        self.assertEqual(problems("Set `wants` and `price`."), [])


class Layout(unittest.TestCase):
    def test_code_blocks_tables_headings_and_definitions_are_passed_over(self):
        long = " ".join(["wants"] * 30)
        for passed in [f"```sh\n{long}\n```", f"| {long} |", f"# {long}", f"[name]: {long}", f"![{long}](picture.png)"]:
            self.assertEqual(problems(f"Before.\n\n{passed}\n\nAfter.\n"), [], passed)

    def test_prose_after_a_code_block_is_looked_at_again(self):
        found = problems("```text\nwants\n```\nIt wants.\n")
        self.assertEqual(len(found), 1)
        self.assertTrue(found[0].startswith("4: "))

    def test_a_number_in_brackets_stands_at_the_end(self):
        self.assertEqual(len(problems("The error (0.03 of it) is small.")), 1)
        self.assertEqual(problems("The error is small (0.03 of it)."), [])
        self.assertEqual(problems("The paper (ICLR 2025) is short."), [])

    def test_lines_are_at_most_200_columns_but_for_tables(self):
        self.assertEqual(problems("```text\n" + "x" * 200 + "\n```"), [])
        self.assertEqual(len(problems("```text\n" + "x" * 201 + "\n```")), 1)
        self.assertEqual(problems("| " + "x" * 300 + " |"), [])

    def test_the_readme_is_held_to_120_lines_of_120_columns(self):
        self.assertEqual(problems("\n" * 120, readme=True), [])
        self.assertIn("121 lines", problems("\n" * 121, readme=True)[0])
        self.assertIn("121 columns", problems("| " + "x" * 119, readme=True)[0])


class Command(unittest.TestCase):
    def test_it_prints_file_and_line_and_exits_with_1_on_findings(self):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "text.md"
            path.write_text("Good.\n\nIt wants more.\n", encoding="utf-8")
            printed = io.StringIO()
            with contextlib.redirect_stdout(printed):
                self.assertEqual(language.main([str(path)]), 1)
            self.assertIn("text.md:3: ", printed.getvalue())
            path.write_text("Good.\n", encoding="utf-8")
            self.assertEqual(language.main([str(path)]), 0)

    def test_the_texts_of_the_project_pass(self):
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            status = language.main([])
        self.assertEqual((status, printed.getvalue()), (0, ""))


if __name__ == "__main__":
    unittest.main()
