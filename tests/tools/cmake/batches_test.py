"""tools/cmake/batches.py: which sources may be compiled together."""
import os
import sys
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), '..', '..', '..', 'tools', 'cmake'))
import batches  # noqa: E402


def together(first, second):
    """Whether two files may come into one batch."""
    files = [('first', batches.read(first)), ('second', batches.read(second))]
    return len(batches.batches(files, 8)) == 1


def unnamed(text):
    return 'namespace a {\nnamespace {\n\n' + text + '\n\n}  // namespace\n}  // namespace a\n'


class Batches(unittest.TestCase):
    def test_files_without_a_common_private_name_come_together(self):
        self.assertTrue(together(unnamed('int one() {\n  return 1;\n}'), unnamed('int two() { return 2; }')))

    def test_no_private_name_is_mentioned_by_another_file_of_the_batch(self):
        use = 'namespace a {\nint g() { return hidden + hidden(1) + hidden<int>(); }\n}\n'
        for definition in ('int hidden() {\n  return 1;\n}', 'constexpr int other = 2, hidden = 1;',
                           'struct hidden {\n  int x;\n};', 'enum class hidden { kOne };',
                           'template <typename T>\nstd::vector<T> hidden(const T& x) {\n  return {x};\n}',
                           'const std::map<int, std::pair<int, int>> hidden{{1, {2, 3}}};',
                           'Eigen::Matrix<double, 3, 2> hidden(\n    double x) {\n  return {};\n}'):
            with self.subTest(definition):
                self.assertFalse(together(unnamed(definition), use))
                self.assertFalse(together(use, unnamed(definition)))

    def test_static_functions_and_macros_are_private_too(self):
        self.assertFalse(together('static int hidden() { return 1; }\n', 'int g() { return hidden(); }\n'))
        self.assertFalse(together('#define HIDDEN 1\n', 'int g() { return HIDDEN; }\n'))

    def test_names_of_a_public_namespace_may_be_mentioned(self):
        self.assertTrue(together('namespace a {\nint shown() { return 1; }\n}\n',
                                 'namespace a {\nint g() { return shown(); }\n}\n'))

    def test_a_name_after_the_unnamed_namespace_is_public(self):
        self.assertTrue(together(unnamed('int one() { return 1; }') + 'int shown() { return 1; }\n',
                                 'int g() { return shown(); }\n'))

    def test_comments_and_texts_mention_nothing(self):
        self.assertTrue(together(unnamed('int hidden() { return 1; }'),
                                 'int g() {\n  // hidden\n  return std::string("hidden \\" hidden").size();\n}\n'))

    def test_equal_aliases_come_together_and_others_do_not(self):
        self.assertTrue(together('using J = b::J2;\nJ x;\n', 'using J = b::J2;\nJ y;\n'))
        self.assertFalse(together('using J = b::J2;\nJ x;\n', 'using J = b::J3;\nJ y;\n'))
        self.assertFalse(together('namespace fs = std::filesystem;\n', 'namespace fs = a::files;\n'))

    def test_batches_hold_each_file_once_and_no_more_than_asked(self):
        files = [(str(i), batches.read(unnamed(f'int f{i}() {{ return 1; }}'))) for i in range(20)]
        lists = batches.batches(files, 8)
        self.assertEqual([len(each) for each in lists], [8, 8, 4])
        self.assertEqual(sorted(name for each in lists for name in each), sorted(name for name, _ in files))


if __name__ == '__main__':
    unittest.main()
