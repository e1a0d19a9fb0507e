//! The files of a package, parsed, and which of them names what of which.
//!
//! A file names another if one of its paths leads to an item that is defined there: a `use` line,
//! or a path in code such as `module::function()`. Re-exports are followed to the definition, so
//! that a facade hides nothing. Code that is compiled for tests alone does not count, and neither
//! do the comments, for documentation may point anywhere.

use std::{
    collections::{BTreeMap, BTreeSet, HashMap},
    fs,
    path::{Path, PathBuf},
};
use syn::{
    Attribute, Expr, File, Item, ItemUse, Macro, Meta, Token, UseTree,
    punctuated::Punctuated,
    visit::{self, Visit},
};

/// A package: its name in code, the folder of its sources, and their roots, the library first.
pub(crate) struct Package {
    pub(crate) name: &'static str,
    pub(crate) folder: &'static str,
    pub(crate) roots: &'static [&'static str],
}

/// For every file the files that it names, each with the names; paths within the folder of the
/// sources.
pub(crate) type Graph = BTreeMap<String, BTreeMap<String, BTreeSet<String>>>;

type ModuleId = usize;

/// Where a path leads.
#[derive(Clone, Copy, PartialEq)]
enum Target {
    Module(ModuleId),
    /// An item of this module.
    Item(ModuleId),
}

/// Something that is brought into a module: a path under a name, or all that is in it.
struct Import {
    path: Vec<String>,
    name: Option<String>,
}

struct Module {
    file: PathBuf,
    parent: Option<ModuleId>,
    root: ModuleId,
    children: HashMap<String, ModuleId>,
    items: BTreeSet<String>,
    imports: Vec<Import>,
    /// Paths in code.
    paths: BTreeSet<Vec<String>>,
}

/// All modules of a package.
#[derive(Default)]
pub(crate) struct Sources {
    modules: Vec<Module>,
    /// Roots, the library first.
    roots: Vec<ModuleId>,
    name: String,
    folder: PathBuf,
}

impl Sources {
    pub(crate) fn read(package: &Package) -> Self {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join(package.folder);
        let mut sources = Self { name: package.name.into(), folder: folder.clone(), ..Self::default() };
        for root in package.roots {
            let id = sources.file(&folder.join(root), None, &folder);
            sources.roots.push(id);
        }
        sources
    }

    /// Reads a module of a file, whose own modules lie in `folder`.
    fn file(&mut self, path: &Path, parent: Option<ModuleId>, folder: &Path) -> ModuleId {
        let text = fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        let File { items, .. } = syn::parse_file(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        self.module(items, path, parent, folder)
    }

    fn module(&mut self, items: Vec<Item>, file: &Path, parent: Option<ModuleId>, folder: &Path) -> ModuleId {
        let id = self.modules.len();
        let root = parent.map_or(id, |parent| self.modules[parent].root);
        self.modules.push(Module {
            file: file.into(),
            parent,
            root,
            children: HashMap::new(),
            items: BTreeSet::new(),
            imports: Vec::new(),
            paths: BTreeSet::new(),
        });
        for item in items {
            if attributes(&item).iter().any(is_for_tests) {
                continue;
            }
            if let Item::Mod(module) = item {
                let name = module.ident.to_string();
                let inner = folder.join(&name);
                let child = match module.content {
                    Some((_, items)) => self.module(items, file, Some(id), &inner),
                    None => {
                        let own = folder.join(format!("{name}.rs"));
                        let path = if own.exists() { own } else { inner.join("mod.rs") };
                        self.file(&path, Some(id), &inner)
                    }
                };
                self.modules[id].children.insert(name, child);
                continue;
            }
            let this = &mut self.modules[id];
            this.items.extend(defined(&item));
            let mut names = Names { module: this };
            names.visit_item(&item);
        }
        id
    }

    /// Where a path leads that is written in a module; `None` out of the package, or to what is no
    /// item of a module.
    fn resolve(&self, from: ModuleId, path: &[String], depth: usize) -> Option<Target> {
        let (first, rest) = path.split_first()?;
        let module = &self.modules[from];
        match first.as_str() {
            "crate" => self.descend(module.root, rest, depth),
            "self" => self.descend(from, rest, depth),
            "super" => self.descend(module.parent?, rest, depth),
            // The library, as the program beside it calls it.
            name if name == self.name && module.root != self.roots[0] => self.descend(self.roots[0], rest, depth),
            _ => self.descend(from, path, depth),
        }
    }

    /// Follows names from a module downwards.
    fn descend(&self, from: ModuleId, path: &[String], depth: usize) -> Option<Target> {
        // Two modules may import all of each other.
        if depth > 16 {
            return None;
        }
        let module = &self.modules[from];
        let Some((first, rest)) = path.split_first() else { return Some(Target::Module(from)) };
        if first == "super" {
            return self.descend(module.parent?, rest, depth);
        }
        if let Some(&child) = module.children.get(first) {
            return self.descend(child, rest, depth);
        }
        if module.items.contains(first) {
            return Some(Target::Item(from));
        }
        let follow = |import: &Import| {
            let path = match &import.name {
                Some(name) if name == first => [&import.path, rest].concat(),
                Some(_) => return None,
                None => [&import.path, path].concat(),
            };
            // A name of another package is not looked for among those that import it.
            if import.path.first() == Some(first) && import.path.len() == 1 {
                return None;
            }
            self.resolve(from, &path, depth + 1)
        };
        let (named, all): (Vec<&Import>, Vec<&Import>) =
            module.imports.iter().partition(|import| import.name.is_some());
        named.into_iter().find_map(follow).or_else(|| all.into_iter().find_map(follow))
    }

    /// Which file names which.
    pub(crate) fn graph(&self) -> Graph {
        let mut graph = Graph::new();
        for (id, module) in self.modules.iter().enumerate() {
            let edges = graph.entry(self.shown(&module.file)).or_default();
            let imports = module.imports.iter().map(|import| &import.path);
            for path in imports.chain(&module.paths) {
                let Some(Target::Item(of)) = self.resolve(id, path, 0) else { continue };
                if self.modules[of].file != module.file {
                    edges.entry(self.shown(&self.modules[of].file)).or_default().insert(path.join("::"));
                }
            }
        }
        graph
    }

    /// Names of other packages that files begin paths with.
    pub(crate) fn foreign(&self, package: &str) -> BTreeSet<String> {
        let names = |module: &&Module| {
            let imports = module.imports.iter().map(|import| &import.path);
            imports.chain(&module.paths).any(|path| path.first().is_some_and(|first| first == package))
        };
        self.modules.iter().filter(names).map(|module| self.shown(&module.file)).collect()
    }

    fn shown(&self, file: &Path) -> String {
        file.strip_prefix(&self.folder).unwrap_or(file).to_string_lossy().replace('\\', "/")
    }
}

/// Collects what a module imports, and the paths in its code.
struct Names<'a> {
    module: &'a mut Module,
}

impl Visit<'_> for Names<'_> {
    fn visit_item(&mut self, item: &Item) {
        if !attributes(item).iter().any(is_for_tests) {
            visit::visit_item(self, item);
        }
    }

    fn visit_item_use(&mut self, item: &ItemUse) {
        tree(&item.tree, &mut Vec::new(), &mut self.module.imports);
    }

    fn visit_path(&mut self, path: &syn::Path) {
        self.module.paths.insert(path.segments.iter().map(|segment| segment.ident.to_string()).collect());
        visit::visit_path(self, path);
    }

    /// What macros are given, where it reads as expressions.
    fn visit_macro(&mut self, called: &Macro) {
        if let Ok(arguments) = called.parse_body_with(Punctuated::<Expr, Token![,]>::parse_terminated) {
            arguments.iter().for_each(|argument| self.visit_expr(argument));
        }
        visit::visit_macro(self, called);
    }

    fn visit_attribute(&mut self, _: &Attribute) {}
}

/// The imports of a `use` line.
fn tree(tree_of: &UseTree, path: &mut Vec<String>, imports: &mut Vec<Import>) {
    match tree_of {
        UseTree::Path(inner) => {
            path.push(inner.ident.to_string());
            tree(&inner.tree, path, imports);
            path.pop();
        }
        UseTree::Group(group) => group.items.iter().for_each(|inner| tree(inner, path, imports)),
        UseTree::Glob(_) => imports.push(Import { path: path.clone(), name: None }),
        UseTree::Name(name) if name.ident == "self" => {
            imports.push(Import { path: path.clone(), name: path.last().cloned() });
        }
        UseTree::Name(name) => {
            let name = name.ident.to_string();
            imports.push(Import { path: [&path[..], std::slice::from_ref(&name)].concat(), name: Some(name) });
        }
        UseTree::Rename(renamed) => {
            let mut whole = path.clone();
            if renamed.ident != "self" {
                whole.push(renamed.ident.to_string());
            }
            imports.push(Import { path: whole, name: Some(renamed.rename.to_string()) });
        }
    }
}

/// The names that an item defines in its module.
fn defined(item: &Item) -> Option<String> {
    let name = match item {
        Item::Const(item) => &item.ident,
        Item::Enum(item) => &item.ident,
        Item::Fn(item) => &item.sig.ident,
        Item::Static(item) => &item.ident,
        Item::Struct(item) => &item.ident,
        Item::Trait(item) => &item.ident,
        Item::Type(item) => &item.ident,
        Item::Union(item) => &item.ident,
        Item::Macro(item) => item.ident.as_ref()?,
        _ => return None,
    };
    Some(name.to_string())
}

fn attributes(item: &Item) -> &[Attribute] {
    match item {
        Item::Const(item) => &item.attrs,
        Item::Enum(item) => &item.attrs,
        Item::Fn(item) => &item.attrs,
        Item::Impl(item) => &item.attrs,
        Item::Macro(item) => &item.attrs,
        Item::Mod(item) => &item.attrs,
        Item::Static(item) => &item.attrs,
        Item::Struct(item) => &item.attrs,
        Item::Trait(item) => &item.attrs,
        Item::Type(item) => &item.attrs,
        Item::Use(item) => &item.attrs,
        _ => &[],
    }
}

/// Whether an attribute is `#[cfg(test)]`, or one that asks for more besides.
fn is_for_tests(attribute: &Attribute) -> bool {
    let Meta::List(list) = &attribute.meta else { return false };
    let asked = list.tokens.to_string();
    list.path.is_ident("cfg") && (asked == "test" || asked.replace(' ', "").starts_with("all(test,"))
}
