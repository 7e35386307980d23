//! Numbers of a section side by side: rows and columns of a table, as the findings' cells say.
//!
//! *in* findings of one section; *out* [`Grid`]s, in the order in which they were found; *never* a number in two tables, or in
//! none if it has a cell; *source* none.

use crate::study::{Cell, Finding};

/// A table of findings.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid<'a> {
    /// Its title.
    pub title: &'a str,
    /// Rows of the paper that its numbers answer, each once.
    pub paper_rows: Vec<u8>,
    /// Titles of the columns.
    pub columns: Vec<&'a str>,
    /// Title and numbers of each row, one for each column.
    pub rows: Vec<(&'a str, Vec<Option<&'a Finding>>)>,
}

/// Tables of the findings that have a cell, and the others.
pub fn grids<'a>(findings: impl Iterator<Item = &'a Finding>) -> (Vec<Grid<'a>>, Vec<&'a Finding>) {
    let (mut grids, mut others): (Vec<Grid<'a>>, Vec<&Finding>) = (Vec::new(), Vec::new());
    for finding in findings {
        let Some(Cell { table, row, column }) = &finding.cell else {
            others.push(finding);
            continue;
        };
        let grid = place(
            &mut grids,
            |grid| grid.title == table,
            || Grid { title: table, paper_rows: Vec::new(), columns: Vec::new(), rows: Vec::new() },
        );
        for paper_row in &finding.rows {
            place(&mut grid.paper_rows, |known| known == paper_row, || *paper_row);
        }
        let at = index(&mut grid.columns, |known| known == column, || column.as_str());
        let (_, cells) = place(&mut grid.rows, |(known, _)| known == row, || (row.as_str(), Vec::new()));
        cells.resize(cells.len().max(at + 1), None);
        cells[at] = Some(finding);
    }
    for grid in &mut grids {
        grid.paper_rows.sort_unstable();
        grid.rows.iter_mut().for_each(|(_, cells)| cells.resize(grid.columns.len(), None));
    }
    (grids, others)
}

/// Index of the first that is wanted, which is added if there is none.
fn index<T>(list: &mut Vec<T>, wanted: impl Fn(&T) -> bool, new: impl FnOnce() -> T) -> usize {
    list.iter().position(wanted).unwrap_or_else(|| {
        list.push(new());
        list.len() - 1
    })
}

fn place<T>(list: &mut Vec<T>, wanted: impl Fn(&T) -> bool, new: impl FnOnce() -> T) -> &mut T {
    let index = index(list, wanted, new);
    &mut list[index]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_number_stands_once_in_its_table_or_among_the_others() {
        let finding = |name: &str, rows: &[u8]| Finding::new("s", name, rows, "what", 1.0, "");
        let all = [
            finding("a", &[7, 4]).cell("t", "first", "mean"),
            finding("alone", &[]),
            finding("b", &[4]).cell("t", "second", "worst"),
            finding("c", &[]).cell("u", "first", "mean"),
        ];
        let (grids, others) = grids(all.iter());
        assert_eq!(others, [&all[1]]);
        assert_eq!((grids[0].columns.as_slice(), grids[0].paper_rows.as_slice()), (&["mean", "worst"][..], &[4, 7][..]));
        assert_eq!(grids[0].rows, [("first", vec![Some(&all[0]), None]), ("second", vec![None, Some(&all[2])])]);
        assert_eq!((grids.len(), grids[1].title), (2, "u"));
    }
}
